"""The note of a capture that is under way: where it is left, the capture was interrupted, and the same command goes on."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from charnerf.data.layout import DATASET_FILE, DatasetInfo, add_to_split, open_or_new, refuse_taken_names
from charnerf.files import write_text


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
    done = [name for name in names if note.is_file() and name not in elsewhere and (root / name).is_dir()]
    refuse_taken_names(info, [name for name in names if name not in done])
    unlisted = [name for name in done if name not in info.splits.get(split, ())]
    if unlisted:  # it was killed between the two
        add_to_split(root, split, unlisted)
    return frozenset(done)


@contextmanager
def noted(note: Path, names: Sequence[str]) -> Iterator[None]:
    """Note a capture while it is under way; the note stays where that is interrupted."""
    write_text(note, json.dumps(list(names)) + "\n")
    yield
    note.unlink(missing_ok=True)
