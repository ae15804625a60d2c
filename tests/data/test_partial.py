"""Characters that are written, and what processes leave of them."""

import os
from pathlib import Path

import pytest

from charnerf.data.partial import character_aside, whole_characters
from tests.support.processes import ended_process


@pytest.mark.parametrize("error", [None, KeyError])
def test_what_ended_processes_left_goes_at_both_ends_and_what_living_ones_write_stays(
    tmp_path: Path, error: type[Exception] | None
) -> None:
    gone = ended_process()
    halves = [tmp_path / f".partial-{gone}-{name}" for name in ("a", "b-c")]
    living = [tmp_path / f".partial-{os.getpid()}-d", tmp_path / ".partial-mine", tmp_path / "e"]
    for folder in (halves[0], *living):
        (folder / "images").mkdir(parents=True)
    try:
        with whole_characters(tmp_path):
            assert not halves[0].exists()
            (halves[1] / "images").mkdir(parents=True)  # a process of the block that was killed
            if error is not None:
                raise error
    except KeyError:
        pass
    assert sorted(tmp_path.iterdir()) == sorted(living)


def test_a_character_is_there_whole_or_not_at_all(tmp_path: Path) -> None:
    with pytest.raises(KeyError), character_aside(tmp_path / "set", "hero") as aside:
        (aside / "images").mkdir()
        raise KeyError
    assert not list((tmp_path / "set").iterdir())
    with character_aside(tmp_path / "set", "hero") as aside:
        (aside / "images").mkdir()
        assert [path.name[0] for path in (tmp_path / "set").iterdir()] == ["."]
    assert [path.name for path in (tmp_path / "set").rglob("*")] == ["hero", "images"]
