"""Characters in the making, one at a time, and those that were made, as long as there is room to look at them."""

import shutil
from collections import deque
from collections.abc import Callable
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any, final

from charnerf.app.background import Background
from charnerf.app.figures import in_order
from charnerf.app.session import CANCELLED, DONE, FAILED, RUNNING, Job, Session
from charnerf.app.settings import Plan
from charnerf.app.worker import Ended, Refused, Worker
from charnerf.errors import ConfigError

FULL = "It ended before it was done: most likely the memory was full. Choose a lower resolution, or smaller pictures."


def make_builder(load: Callable[[], Any]) -> Any:
    """What makes a character, made in its process."""
    from charnerf.app.builder import Builder

    return Builder(load)


@final
class Queue:
    """Jobs of all sessions.

    Args:
        context: How processes are started.
        load: Gives the model, in another process.
        most_kept: Characters that can be looked at; the one that was made first goes first.
    """

    def __init__(self, context: BaseContext, load: Callable[[], Any], most_kept: int) -> None:
        self.context, self.load, self.most_kept = context, load, most_kept
        self.waiting: deque[Job] = deque()
        self.running: Job | None = None
        self.kept: list[Session] = []  # that can be looked at, the oldest first
        self.background = Background()

    def build(self, session: Session, plan: Plan) -> None:
        """Put a character into the queue.

        Raises:
            ConfigError: If one of this session is in it already.
            DataError: If the figures are no character.
        """
        if session.job is not None and session.job.is_active:
            raise ConfigError("This page's character is being made already: cancel it, or wait for it.")
        in_order(session.figures)
        session.job = Job(session.next_number(), session, list(session.figures), plan)
        self.waiting.append(session.job)
        self._next()

    def place(self, session: Session) -> int | None:
        """How many characters are made before this session's; None where it has none that waits."""
        if session.job is None or session.job not in self.waiting:
            return None
        return self.waiting.index(session.job) + (self.running is not None)

    def cancel(self, session: Session) -> None:
        """End this session's job; the next one begins."""
        job = session.job
        if job is None or not job.is_active:
            return
        job.state = CANCELLED
        if job in self.waiting:
            self.waiting.remove(job)
        elif job.worker is not None:
            job.worker.end()
        self._tell_queue(session)

    def _next(self) -> None:
        """Begin the first in the queue, if nothing is being made."""
        if self.running is None and self.waiting:
            self.running = self.waiting.popleft()
            self.running.state = RUNNING
            self.background.begin(self._make(self.running))
        self._tell_queue()

    def _tell_queue(self, *others: Session) -> None:
        for session in {*(job.session for job in self.waiting), *others}:
            session.tell()

    async def _make(self, job: Job) -> None:
        """Make a character in a process of its own."""
        session = job.session
        folder = session.folder / f"made{session.next_number()}"
        try:
            if job.state != RUNNING:
                raise Ended  # it was cancelled before it began
            job.worker = Worker(self.context, make_builder, self.load)
            product = await job.worker.call(
                "build", on_moment=job.follow, figures=job.figures, plan=job.plan, folder=folder
            )
            if job.state == RUNNING:
                self._take(job, product, folder)
        except Refused as error:
            self._fail(job, session.words(str(error)))
        except Ended:
            self._fail(job, FULL)
        except OSError as error:
            self._fail(
                job,
                f"No process could be started for it ({error}). Build it again when the machine is less busy.",
            )
        finally:
            if job.state != DONE:
                self._clear(job, folder)
            self.running = None
            session.tell()
            self._next()

    def _clear(self, job: Job, folder: Path) -> None:
        """End its process and remove what it has written, also what it was writing."""
        if job.worker is not None:
            job.worker.end()
        for piece in job.session.folder.glob(f"*{folder.name}*"):
            shutil.rmtree(piece, ignore_errors=True)

    def _fail(self, job: Job, problem: str) -> None:
        if job.state == RUNNING:
            job.state, job.problem = FAILED, problem

    def _take(self, job: Job, product: Any, folder: Path) -> None:
        """Show what was made in place of what was made before."""
        session = job.session
        before = session.made_in
        self.let_go(session)
        job.state, session.product, session.made_in, session.worker = DONE, product, folder, job.worker
        self.kept.append(session)
        for oldest in self.kept[: -self.most_kept]:
            self.let_go(oldest)
            oldest.tell()
        if before is not None:
            shutil.rmtree(before, ignore_errors=True)

    def let_go(self, session: Session) -> None:
        """End the process that looks at what was made."""
        if session.worker is not None:
            session.worker.end()
            session.worker = None
            self.kept.remove(session)

    async def look(
        self, session: Session, *, azimuth_deg: float, elevation_deg: float, size: int, moving: bool
    ) -> bytes:
        """A picture of what was made, PNG.

        Raises:
            Refused: If nothing is there to be looked at.
        """
        gone = "The field is not in memory any more: build the character again to look at it."
        if session.worker is None:
            raise Refused(gone)
        try:
            picture: bytes = await session.worker.call(
                "look", azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, size=size, moving=moving
            )
        except Ended as error:
            self.let_go(session)
            session.tell()
            raise Refused(gone) from error
        return picture
