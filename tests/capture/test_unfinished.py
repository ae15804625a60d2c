"""Characters are listed while others are made, and all that are whole are listed when the making ends."""

from pathlib import Path

import pytest

from charnerf.capture.unfinished import listed_as_made


def test_lists_are_written_in_time_that_grows_with_the_number_of_characters(tmp_path: Path) -> None:
    """Each writing is of the whole list; lots of one would write a half of the square."""
    names, listed, written = [f"n{index}" for index in range(4000)], [], []

    def add(more: list[str]) -> None:
        listed.extend(more)
        written.append(len(listed))

    with listed_as_made(tmp_path, names, add) as end:
        for name in names:
            end(name, True)
    assert listed == names and written[0] == 1 and sum(written) < 15 * len(names)


def test_what_is_whole_when_the_making_is_stopped_is_listed_once(tmp_path: Path) -> None:
    """b was made while the first's end was awaited; c has failed, and another one's folder is there; d was not begun."""
    listed: list[str] = []
    with pytest.raises(KeyError), listed_as_made(tmp_path, list("abcd"), listed.extend) as end:
        for name in "abc":
            (tmp_path / name).mkdir()
        end("a", True)
        end("c", False)
        raise KeyError
    assert listed == ["a", "b"]


def test_a_list_that_can_not_be_written_is_tried_again_at_the_end(tmp_path: Path) -> None:
    listed: list[str] = []
    tries = []

    def add(names: list[str]) -> None:
        tries.append(1)
        if len(tries) == 1:
            raise OSError(28, "No space left on device")
        listed.extend(names)

    with pytest.raises(OSError, match="No space"), listed_as_made(tmp_path, ["a"], add) as end:
        end("a", True)
    assert listed == ["a"]
