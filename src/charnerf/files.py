"""Files that are there whole or not at all: written beside their place, then renamed into it; and locks between processes."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def write_aside(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to: its file takes the place of `path` when the block ends, and goes if it raises.

    Readers see the old file or the new one, never a part. Folders that `path` lacks are made.

    Args:
        path: The file to write.

    Yields:
        A hidden name in the same folder that ends in .part, so that no search by suffix finds it; libraries that
        choose a format by suffix have to be given the format.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield aside
        os.replace(aside, path)
    finally:
        aside.unlink(missing_ok=True)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a folder, or a file that is made for it, against other processes; the system frees the lock of a killed one."""
    try:
        import fcntl
    except ImportError:  # Windows: two processes at once are not guarded from each other
        yield
        return
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    with write_aside(path) as aside:
        aside.write_text(text, encoding="utf-8")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with write_aside(path) as aside:
        aside.write_bytes(content)
