"""The server's folder for temporary files: nobody else's, gone when the server ends, and when it was killed, with the next one."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from charnerf.files import is_locked, locked

PREFIX = "charnerf-app-"


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder that only this user can read; it goes when the block ends."""
    for old in (
        Path(tempfile.gettempdir()).glob(f"{PREFIX}*/lock") if os.name == "posix" else ()
    ):  # else no locks
        if old.stat().st_uid == os.getuid() and not is_locked(old):
            shutil.rmtree(old.parent, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as folder:
        with locked(Path(folder) / "lock"):
            yield Path(folder)
