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


def test_the_dearest_is_begun_first_and_results_come_in_the_order_of_the_names(monkeypatch):
    """The copy that was sent is opened once, and counts on from call to call."""

    class OneByOne:
        def __init__(self, work, items, processes):
            self.results = [(item, work(item)) for item in items]

        def __enter__(self):
            return iter(self.results)

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(side_by_side, "in_processes", OneByOne)
    log, shares, cost = [], [], {"a": 2.0, "b": 3.0, "c": 1.0, "d": 0.0}.get
    names = ["a", "b", "c", "d"]
    measured = measured_side_by_side(partial(measure, log), names, 2, cost=cost, on_share=shares.append)
    assert measured == [(2, "a"), (1, "b"), (3, "c"), (4, "d")]
    assert log == [] and shares == [0.25, 0.5, 0.75, 1.0]


def test_an_error_is_the_characters_own():
    with pytest.raises(DataError, match="broken: no picture"):
        measured_side_by_side(partial(measure, []), ["broken"], 1, cost=len, on_share=lambda share: None)
