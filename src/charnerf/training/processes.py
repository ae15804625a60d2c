"""The processes that a training takes on one machine, such as one a GPU.

The command's own process trains nothing then: it has checked and prepared everything, hands the others their work, passes
signals and logs on, and ends all when one has failed. Without this, Lightning would start the whole command again for each.
"""

import logging
import multiprocessing
import os
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from logging.handlers import QueueHandler
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pickle import UnpicklingError
from queue import SimpleQueue

import lightning as L
from lightning.fabric.plugins.environments.lightning import find_free_network_port
from omegaconf import DictConfig

from charnerf.data.sampler import Share
from charnerf.errors import CharNeRFError, ConfigError
from charnerf.inference.build import build_part
from charnerf.interruption import SIGNALS, Stopped, end_with_parent, listening, requested
from charnerf.progress import reported_to
from charnerf.training.trainer import environment

TICK = 0.5  # seconds between two looks at whether a signal has come
PATIENCE = 10.0  # seconds for the others to end by themselves when one has failed
BEGIN_OTHERWISE = ("spawn", "fork", "notebook")  # parts of the names of Lightning's strategies


def processes_to_begin(cfg: DictConfig) -> int:
    """How many processes `trainer` asks for that nobody has begun yet; 1 where this one is enough.

    Raises:
        ConfigError: If they are to be on several machines, or to begin in other ways.
    """
    trainer = _trainer(cfg)
    if trainer.world_size == 1 or environment().creates_processes_externally:
        return 1
    if trainer.num_nodes > 1:
        raise ConfigError(
            f"trainer.num_nodes: found {trainer.num_nodes}, but this process was started alone, expected 1; start one process a"
            " device by srun or torchrun."
        )
    if any(part in str(cfg.trainer.get("strategy")) for part in BEGIN_OTHERWISE):
        raise ConfigError(f"trainer.strategy: found {cfg.trainer.strategy}, expected ddp.")
    return trainer.num_devices


def meet(cfg: DictConfig) -> Share:
    """Meet the other processes that srun or torchrun has begun for a training, if it has.

    Returns:
        This process's place among them.
    """
    trainer = _trainer(cfg)
    share = Share(trainer.global_rank, trainer.world_size)
    if share.processes > 1:
        trainer.strategy.setup_environment()
    return share


def check_alone(cfg: DictConfig) -> None:
    """Check that srun or torchrun has not begun several processes for a grid: each would begin the next cell.

    Raises:
        ConfigError: If it has.
    """
    if processes_to_begin(cfg) == 1 and _trainer(cfg).world_size > 1:
        raise ConfigError(
            "-m: found several processes that srun or torchrun has begun, expected one: a grid begins those of each cell itself, by"
            " trainer=ddp; with hydra/launcher=submitit_slurm set hydra.launcher.tasks_per_node=1."
        )


def _trainer(cfg: DictConfig) -> L.Trainer:
    """Lightning's trainer, to ask what it would begin."""
    quiet = dict.fromkeys(
        ("logger", "enable_checkpointing", "enable_progress_bar", "enable_model_summary"), False
    )
    trainer: L.Trainer = build_part(cfg.trainer, {**quiet, "plugins": [environment()]})
    return trainer


@contextmanager
def first_speaks(share: Share) -> Iterator[None]:
    """Let all processes but the first say nothing but errors meanwhile."""
    if share.process == 0:
        yield
        return
    logging.disable(logging.WARNING)
    try:
        with warnings.catch_warnings(action="ignore"), reported_to(lambda moment: None):
            yield
    finally:
        logging.disable(logging.NOTSET)


@dataclass(frozen=True)
class _Report:
    """Why a process has ended before its work, and when."""

    time: float
    error: BaseException


class _Member:
    """One of the processes; a thread takes what it says. Each has a way of its own: one that is killed blocks no other's."""

    def __init__(self, process: SpawnProcess, said: Connection) -> None:
        self.process = process
        self.report: _Report | None = None
        self._said = said
        self._thread = threading.Thread(target=self._take, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """End it if it has not ended, and take the rest."""
        self.process.kill()
        self.process.join()
        self._thread.join()

    def _take(self) -> None:
        """Log its records as if they were of this process; keep its report."""
        while True:
            try:
                message = self._said.recv()
            except (EOFError, OSError, UnpicklingError):  # it has ended, perhaps in the middle of a word
                return
            if isinstance(message, _Report):
                self.report = message
            else:
                logger = logging.getLogger(message.name)
                if logger.isEnabledFor(message.levelno):
                    logger.handle(message)


def run_processes(work: Callable[[Share], None], count: int) -> None:
    """Do work in processes that find one another by torch's distributed package, and wait until all have ended.

    Args:
        work: Gets the process's number. It can be pickled.
        count: How many processes.

    Raises:
        Stopped: If a signal came, to this process or to one of them.
        CharNeRFError: If a process was killed.
        Exception: The first that one of them raised.
    """
    context = multiprocessing.get_context("spawn")
    members: list[_Member] = []
    port = find_free_network_port()
    try:
        for number in range(count):
            here, there = context.Pipe(duplex=False)
            process = context.Process(target=_work, args=(work, Share(number, count), port, there))
            with _signals_later():  # until the process has its own answer to them
                process.start()
            there.close()
            members.append(_Member(process, here))
        _await(members)
        codes = [member.process.exitcode or 0 for member in members]  # before those left are ended
    finally:
        for member in members:
            member.end()
    _raise_first(codes, [member.report for member in members if member.report is not None])


def _await(members: Sequence[_Member]) -> None:
    """Wait until all have ended; a signal is passed on, and where one has failed the others are given some time."""
    passed, end = None, None
    while running := [member.process for member in members if member.process.is_alive()]:
        wait([process.sentinel for process in running], TICK)
        if requested() is not None and passed is None:
            passed = requested()
            for process in running:
                assert process.pid is not None
                os.kill(process.pid, passed or signal.SIGTERM)
        failed = [one for one in members if one.process.exitcode not in (None, 0)]
        if failed and end is None:
            end = time.monotonic() + PATIENCE
        if end is not None and time.monotonic() > end:
            return


def _raise_first(codes: Sequence[int], reports: Sequence[_Report]) -> None:
    """Raise what ended them: a kill that nobody asked for, or the first error."""
    for number, code in enumerate(codes):
        if code < 0 and requested() is None:
            raise CharNeRFError(
                f"process {number} of {len(codes)} was ended by {signal.Signals(-code).name}, expected all to live; was there"
                " memory enough? The same command goes on, a single run's with its hydra.run.dir and ckpt_path=last."
            )
    for report in sorted(reports, key=lambda report: report.time):
        raise report.error


@contextmanager
def _signals_later() -> Iterator[None]:
    """Let signals wait meanwhile; a process that is begun here inherits it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Voice(QueueHandler):
    """Says log records to the process that began this one; a handler's lock lets one thread speak at a time."""

    def __init__(self, said: Connection) -> None:
        super().__init__(SimpleQueue())  # which stays empty
        self.said = said

    def enqueue(self, record: logging.LogRecord) -> None:
        """Say one, unless nobody listens any more."""
        with suppress(OSError):
            self.said.send(record)


def _work(work: Callable[[Share], None], share: Share, port: int, said: Connection) -> None:
    """What one of the processes does."""
    parent = multiprocessing.parent_process()
    if parent is None or os.getppid() != parent.pid:
        return  # it was killed meanwhile
    end_with_parent()
    os.environ |= {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port), "LOCAL_RANK": str(share.process)}
    root = logging.getLogger()
    root.setLevel(logging.INFO)
    voice = _Voice(said)
    root.addHandler(voice)
    failure: BaseException | None = None
    try:
        with listening(in_worker=True), first_speaks(share):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
            work(share)
    except BaseException as error:
        failure = error
    if failure is None:
        return
    voice.acquire()
    with suppress(OSError):
        said.send(_Report(time.monotonic(), _portable(failure)))
    os._exit(1)  # an ordinary end would wait for workers, and for processes that have failed


def _portable(error: BaseException) -> BaseException:
    """An error as another process can raise it; its trace is a note."""
    try:
        restored = multiprocessing.reduction.ForkingPickler.loads(
            multiprocessing.reduction.ForkingPickler.dumps(error)
        )
        portable = error if isinstance(restored, type(error)) else None
    except Exception:  # whatever an error's class does when it is pickled
        portable = None
    portable = portable or RuntimeError(f"{type(error).__name__}: {error}")
    if not isinstance(error, Stopped):
        portable.add_note("".join(traceback.format_exception(error)))
    return portable
