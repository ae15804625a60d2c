"""All sessions: opened, forgotten when no page looks at them any more, and their work."""

import asyncio
import secrets
import shutil
from collections.abc import Callable
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any, final

from charnerf.app.limits import Limits
from charnerf.app.queue import Queue
from charnerf.app.reader import Reader
from charnerf.app.session import Session
from charnerf.errors import DataError
from charnerf.pools import clean_processes


def process_context() -> BaseContext:
    """How the page's processes are started: from one that has imported all and computed nothing."""
    return clean_processes("charnerf.app.recognizer", "charnerf.app.builder")


@final
class Studio:
    """Sessions by id; it lives in the server's one thread, as all that it holds.

    Args:
        folder: For files; its own.
        load: Gives the model, in another process.
        context: How processes are started.
        limits: What it takes on.
    """

    def __init__(
        self, folder: Path, load: Callable[[], Any], context: BaseContext, limits: Limits | None = None
    ) -> None:
        self.folder = folder
        self.limits = limits or Limits()
        self.sessions: dict[str, Session] = {}
        self.reader = Reader(context, load, self.limits)
        self.queue = Queue(context, load, self.limits.kept)

    def open(self) -> Session:
        """A new session.

        Raises:
            DataError: If there are too many whose pages are open.
        """
        if len(self.sessions) >= self.limits.sessions:
            alone = next((one for one in self.sessions.values() if not one.pages), None)
            if alone is None:
                raise DataError(
                    f"{self.limits.sessions} pages are open, which is as many as there may be. Try again later."
                )
            self.forget(alone)
        name = secrets.token_urlsafe(24)
        session = self.sessions[name] = Session(name, self.folder / name)
        session.folder.mkdir(mode=0o700)
        self._mind(session)
        return session

    def came(self, session: Session) -> None:
        """A page looks at it."""
        session.pages += 1
        self._mind(session)

    def left(self, session: Session) -> None:
        """A page is gone."""
        session.pages -= 1
        self._mind(session)

    def _mind(self, session: Session) -> None:
        """Watch for how long no page looks at it."""
        for timer in session.timers:
            timer.cancel()
        session.timers = []
        if not session.pages and session.name in self.sessions:
            loop = asyncio.get_running_loop()
            session.timers = [
                loop.call_later(self.limits.grace_s, self.queue.cancel, session),
                loop.call_later(self.limits.keep_s, self.forget, session),
            ]

    def forget(self, session: Session) -> None:
        """End its work and remove its files."""
        self.sessions.pop(session.name, None)
        for timer in session.timers:
            timer.cancel()
        self.queue.cancel(session)
        self.queue.let_go(session)
        shutil.rmtree(session.folder, ignore_errors=True)
        session.tell()

    def close(self) -> None:
        """End all work and remove all files."""
        for session in list(self.sessions.values()):
            self.forget(session)
        self.reader.close()
