"""Processes that have ended, and commands in processes of their own."""

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from multiprocessing.process import BaseProcess
from pathlib import Path

from charnerf.cli import main


def ended_process() -> int:
    """Number of a process that is no more."""
    process = subprocess.Popen([sys.executable, "-S", "-c", ""])
    process.wait()
    return process.pid


def begin_command(arguments: Sequence[str], log: Path) -> BaseProcess:
    """Begin `charnerf ...` with a group of its own and all that it prints in a file.

    The process is forked from this one: a new interpreter imports torch and Lightning for ten seconds.
    """
    process = multiprocessing.get_context("fork").Process(target=_command, args=(list(arguments), log))
    process.start()
    return process


def _command(arguments: list[str], log: Path) -> None:
    os.setsid()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(file, 1)
    os.dup2(file, 2)
    sys.stdout, sys.stderr = open(1, "w", buffering=1), open(2, "w", buffering=1)  # instead of pytest's
    sys.argv = ["charnerf", *arguments]
    main()
