"""Characters while they are written: a hidden folder beside their place, which processes that are stopped or killed may leave."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from charnerf.files import named_in_errors

_PREFIX = ".partial-"


@contextmanager
def character_aside(root: Path, name: str) -> Iterator[Path]:
    """A folder to write a character into: it becomes the character's when the block ends, and goes if the block raises.

    Args:
        root: Folder of the data set; made if missing.
        name: The character's name; no folder of that name may be there when the block ends.
    """
    aside = root / f"{_PREFIX}{os.getpid()}-{name}"
    shutil.rmtree(aside, ignore_errors=True)
    try:
        with named_in_errors(root / name, aside):
            aside.mkdir(parents=True)  # in here: a signal that comes meanwhile is answered right behind it
            yield aside
            aside.rename(root / name)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


@contextmanager
def whole_characters(root: Path) -> Iterator[None]:
    """A block whose processes write characters: when it begins, and however it ends, half-written ones go.

    Those of living processes stay.
    """
    _remove_halves(root)
    try:
        yield
    finally:
        _remove_halves(root)


def _remove_halves(root: Path) -> None:
    for folder in root.glob(f"{_PREFIX}*"):
        writer = folder.name.removeprefix(_PREFIX).split("-")[0]
        if writer.isdigit() and not _is_alive(int(writer)):
            shutil.rmtree(folder, ignore_errors=True)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
