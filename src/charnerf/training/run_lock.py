"""One command at a time works in a run folder, until the last of its processes has ended."""

import logging
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Self, final

from charnerf.errors import ConfigError

log = logging.getLogger(__name__)
LOCK_FILE = ".run.lock"
# seconds for the processes of a command that was killed: on a busy machine they import for minutes before they notice
PATIENCE = 300.0
_TICK = 0.1


@final
class RunLock:
    """Holds a run folder against other commands from `take` to the end of the block, or of the process.

    Processes that are begun while it is held, and get it as an argument, hold it too: where the command is killed the folder
    is free once they have ended. The system frees what a killed process held. Windows, and file systems without locks, leave
    two commands unguarded.

    Args:
        folder: The run folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._handle: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

    def __reduce__(self) -> tuple[object, ...]:
        from multiprocessing.reduction import DupFd  # of a process that is being begun

        return _inherited, (self.folder, None if self._handle is None else DupFd(self._handle))

    def take(self) -> None:
        """Hold the folder, which is there; wait for processes of a command that was killed.

        Raises:
            ConfigError: If another command goes on working there.
        """
        try:
            import fcntl
        except ImportError:
            return
        self._handle = os.open(self.folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o666)
        end, told = time.monotonic() + PATIENCE, False
        with suppress(OSError):  # of a file system without locks
            while True:
                try:
                    return fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    self._wait(end, told=told)
                    told = True

    def _wait(self, end: float, *, told: bool) -> None:
        if time.monotonic() > end:
            raise ConfigError(
                f"hydra.run.dir: {self.folder} is worked in by another command, expected none; wait for its end, or name another"
                " folder."
            )
        if not told:
            log.warning("Waits for another command's processes in %s, %.0f s at most.", self.folder, PATIENCE)
        time.sleep(_TICK)


def _inherited(folder: Path, handle: object) -> RunLock:
    lock = RunLock(folder)
    lock._handle = None if handle is None else handle.detach()  # type: ignore[attr-defined]
    return lock
