"""Characters measured in other processes: one pickle for all, results in the order asked for; whole evaluations are slow tests."""

from functools import partial

import pytest

from charnerf.errors import DataError
from charnerf.evaluation import side_by_side
from charnerf.evaluation.side_by_side import measured_side_by_side


def measure(log, name):
    if name == "broken":
        raise DataError("broken: no picture")
    log.append(name)
    return len(log), name


def test_results_come_in_the_order_of_the_names_from_what_is_opened_once(monkeypatch):
    """The copy that was sent counts on from call to call; the last to be done is the first asked for."""

    class Backwards:
        def __init__(self, work, items, processes):
            self.results = [(item, work(item)) for item in reversed(items)]

        def __enter__(self):
            return iter(self.results)

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(side_by_side, "in_processes", Backwards)
    log, shares = [], []
    assert measured_side_by_side(partial(measure, log), ["a", "b"], 2, shares.append) == [
        (2, "a"),
        (1, "b"),
    ]
    assert log == [] and shares == [0.5, 1.0]


def test_an_error_is_the_characters_own():
    with pytest.raises(DataError, match="broken: no picture"):
        measured_side_by_side(partial(measure, []), ["broken"], 1, lambda share: None)
