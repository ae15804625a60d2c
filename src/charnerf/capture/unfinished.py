"""Captures under way: a note, by which the same command goes on with an interrupted one, and when characters are listed."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from charnerf.data.layout import DATASET_FILE, DatasetInfo, add_to_split, open_or_new, refuse_taken_names
from charnerf.data.partial import whole_characters
from charnerf.files import write_text
from charnerf.interruption import held

_LOT = 0.1  # of those listed: a list is written as a whole, so that lots of one would cost the square of their number


def note_of(root: Path, files: Sequence[Path], *settings: Any) -> Path:
    """The hidden file of the data set that notes a capture; its name tells the command.

    Args:
        root: Folder of the data set.
        files: The meshes: others, or changed ones, are another capture.
        settings: Everything else that makes a difference.
    """
    meshes = []
    for file in files:
        state = file.stat()
        meshes.append([str(file.resolve()), state.st_size, state.st_mtime_ns])
    text = json.dumps([meshes, settings], sort_keys=True, default=str)
    return root / f".capture-{hashlib.sha256(text.encode()).hexdigest()[:12]}.json"


def there_already(root: Path, split: str, names: Sequence[str], note: Path) -> frozenset[str]:
    """Characters of a capture that it had made when it was interrupted, all listed now; none where it begins.

    Raises:
        DataError: If a name is taken by another capture, or is none.
    """
    has_list = (
        root / DATASET_FILE
    ).exists() or not note.is_file()  # else it was killed before its first line
    info = open_or_new(root) if has_list else DatasetInfo(root=root, splits={}, made_by={})
    elsewhere = {name for other, members in info.splits.items() if other != split for name in members}
    goes_on = note.is_file()
    done = {name for name in names if goes_on and name not in elsewhere and (root / name).is_dir()}
    refuse_taken_names(info, [name for name in names if name not in done])
    unlisted = sorted(done.difference(info.splits.get(split, ())))
    if unlisted:  # it was killed before it listed them
        add_to_split(root, split, unlisted)
    return frozenset(done)


@contextmanager
def noted(note: Path, names: Sequence[str]) -> Iterator[None]:
    """Note a capture while it is under way; the note stays where that is interrupted."""
    write_text(note, json.dumps(list(names)) + "\n")
    yield
    note.unlink(missing_ok=True)


@contextmanager
def listed_as_made(
    root: Path, names: Sequence[str], add: Callable[[list[str]], object]
) -> Iterator[Callable[[str, bool], None]]:
    """A block whose processes write characters: however it ends, all that are whole are listed, and no others are left.

    Args:
        root: Folder of the data set.
        names: The characters; none is there or listed yet.
        add: Adds some to the data set's lists.

    Yields:
        To be called with each name that has come to its end, and whether it was made; such are listed in lots that grow with
        their number.
    """
    ended: set[str] = set()
    waiting: list[str] = []

    def end(name: str, is_made: bool) -> None:
        with held():  # a signal in between would leave one out, or list some twice
            ended.add(name)
            waiting.extend([name] if is_made else [])
            if len(waiting) > _LOT * len(ended):
                add(waiting)
                waiting.clear()

    try:
        with whole_characters(root):
            yield end
    finally:
        rest = [*waiting, *(name for name in names if name not in ended and (root / name).is_dir())]
        if rest:
            add(rest)
