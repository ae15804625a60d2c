"""SIGTERM, SIGINT and SIGHUP: the first asks a process to end, a second one ends it at once.

A door listens (`listening`); then a signal raises `Stopped`, which cleans up as an error does and ends in exit status 143,
130 or 129. Work that has to come to a point of its own first holds signals back (`held`).
"""

import logging
import multiprocessing
import os
import signal
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import NoReturn

_NAMES = ("SIGTERM", "SIGINT", "SIGHUP")  # Windows has no terminals that hang up
SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
_DEFAULTS = (signal.SIG_DFL, signal.default_int_handler)
_PATIENCE = 60.0  # seconds for a last checkpoint
_NOTE = b"\nstopping as soon as what is at hand is whole; a second signal ends at once.\n"


class Stopped(BaseException):
    """A signal asked the process to end; no `Exception`, so that what goes on after errors does not go on after this.

    Attributes:
        number: The signal's.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number

    @property
    def status(self) -> int:
        """The exit status: 128 and the signal's number, as shells say it."""
        return 128 + self.number

    def __str__(self) -> str:
        return f"stopped by {signal.Signals(self.number).name}."


@dataclass
class _Interruption:
    """What signals have asked for.

    Attributes:
        received: Number of the signal that came, None before.
        holds: How many blocks hold signals back.
        process: Which process listens; those that it forks leave signals to it.
        in_worker: Whether it works for another.
    """

    received: int | None = None
    holds: int = 0
    process: int = 0
    in_worker: bool = False


_interruption = _Interruption()


@contextmanager
def listening(*, in_worker: bool = False) -> Iterator[None]:
    """Let the first signal raise `Stopped` meanwhile; a handler that somebody else has set stays.

    Only the main thread can listen; in others this does nothing.

    Args:
        in_worker: Of a pool: nothing is said, and no second signal ends it at once; a pool sends one when others have ended.
    """
    mine = []
    if threading.current_thread() is threading.main_thread():
        mine = [number for number in SIGNALS if signal.getsignal(number) in _DEFAULTS]
    before = {number: signal.getsignal(number) for number in mine}
    if mine:
        _interruption.received, _interruption.process, _interruption.in_worker = None, os.getpid(), in_worker
        listen(mine)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if mine:
            _interruption.received, _interruption.process = None, 0


def listen(numbers: tuple[signal.Signals, ...] | list[signal.Signals] = SIGNALS) -> None:
    """Take signals (again, where a library has put a handler of its own before ours)."""
    for number in numbers:
        signal.signal(number, _on_signal)


def is_listening() -> bool:
    """Whether this process, not one that it was forked from, listens."""
    return _interruption.process == os.getpid()


@contextmanager
def held() -> Iterator[None]:
    """Hold signals back: one that came raises `Stopped` when the block ends without another error.

    A block that can end early looks at `requested`.
    """
    _interruption.holds += 1
    try:
        yield
    finally:
        _interruption.holds -= 1
    if _interruption.received is not None and not _interruption.holds:
        raise Stopped(_interruption.received)


def requested() -> int | None:
    """Number of the signal that came; None before."""
    return _interruption.received


def leave(status: int) -> NoReturn:
    """End the process with an exit status; after a signal at once, when all is cleaned up.

    Python joins its worker processes when it ends, and waits for ever for one that leaves signals to its parent and hangs on
    a batch that nobody takes. Such workers end when their parent has (`end_with_parent`, and torch's own watch).
    """
    if status in {128 + number for number in SIGNALS}:
        logging.shutdown()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


def leave_signals_to_parent() -> None:
    """Ignore both signals in a worker process: who asks a group of processes to end is answered by their parent."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@cache
def end_with_parent() -> None:
    """Ask this process to end once its parent has, however that ended; what does not end then is ended."""
    above, parent = os.getppid(), _parent_with_pipe()

    def watch() -> None:
        # the process above may be one that starts others; the parent's pipe does not tell where others hold it too
        while os.getppid() == above and (parent is None or parent.is_alive()):
            time.sleep(1.0)
        os.kill(os.getpid(), signal.SIGTERM)
        end = time.monotonic() + _PATIENCE
        while is_listening() and time.monotonic() < end:
            time.sleep(0.1)
        os._exit(128 + signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()


def _parent_with_pipe() -> BaseProcess | None:
    """This process's parent where a pipe tells of its end; a library's own processes, such as joblib's, have none."""
    parent = multiprocessing.parent_process()
    try:
        if parent is not None:
            parent.is_alive()
    except (TypeError, ValueError):  # of a pipe that is None
        return None
    return parent


def _on_signal(number: int, _: FrameType | None) -> None:
    if not is_listening():  # forked meanwhile
        os._exit(128 + number)
    has_hung_up = signal.Signals(number).name == "SIGHUP"
    if _interruption.received is not None:
        if _interruption.in_worker or has_hung_up:  # a closed terminal's system and shell both send one
            return
        os._exit(128 + number)
    _interruption.received = number
    if has_hung_up:
        _leave_terminal()
    if not _interruption.in_worker:
        os.write(2, _NOTE)
    if not _interruption.holds:
        raise Stopped(number)


def _leave_terminal() -> None:
    """Write to nowhere what would go to a terminal that is gone: every line would be an error, in the midst of a checkpoint."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        with suppress(OSError):  # closed
            if stat.S_ISCHR(os.fstat(number).st_mode):
                os.dup2(nowhere, number)
    os.close(nowhere)
