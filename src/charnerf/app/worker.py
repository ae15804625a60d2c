"""A process of its own that answers calls, one at a time, and can be ended at any moment.

Why a process and not a thread: what torch computes can not be stopped from outside, its memory goes back to the system only with
the process, and one that the system kills for want of memory takes nothing else with it.
"""

import asyncio
import sys
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any, final

from charnerf.errors import CharNeRFError
from charnerf.files import error_words
from charnerf.interruption import end_with_parent, leave_signals_to_parent
from charnerf.progress import Moment, reported_to
from charnerf.wording import worded_for_page

TELL_EVERY = 0.2  # seconds between two moments of one stage


class Ended(Exception):
    """The process ended before it answered: it was ended, or the system did."""


class Refused(Exception):
    """What was asked can not be done; the message says why and what to do."""


@final
class Worker:
    """The side that asks.

    Args:
        context: How processes are started.
        make: Called once in the process; its result's methods are what can be called.
        arguments: For `make`; whatever is given crosses to the process as a copy.
    """

    def __init__(self, context: BaseContext, make: Callable[..., Any], *arguments: Any) -> None:
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_answer, args=(theirs, make, arguments), daemon=True)  # type: ignore[attr-defined]
        self.process.start()
        theirs.close()
        self.thread = ThreadPoolExecutor(1, "worker")  # where an answer is waited for
        self.lock = asyncio.Lock()
        self.is_ended = False

    async def call(
        self, name: str, *, on_moment: Callable[[Moment], object] = lambda moment: None, **keywords: Any
    ) -> Any:
        """Call a method of what the process made, after the calls before it.

        Raises:
            Refused: If it raised an error.
            Ended: If the process ended first.
        """
        # whoever asks may go; the answer is read all the same, else the next call would get it
        return await asyncio.shield(self._exchange(name, keywords, on_moment))

    async def _exchange(
        self, name: str, keywords: dict[str, Any], on_moment: Callable[[Moment], object]
    ) -> Any:
        loop = asyncio.get_running_loop()
        async with self.lock:
            if self.is_ended:
                raise Ended
            try:
                self.connection.send((name, keywords))
                while True:
                    kind, content = await loop.run_in_executor(self.thread, self.connection.recv)
                    if kind == "done":
                        return content
                    if kind == "refused":
                        raise Refused(content)
                    on_moment(content)
            except (EOFError, OSError) as error:
                raise Ended from error

    def end(self) -> None:
        """End the process at once; whoever waits for an answer gets `Ended`."""
        if self.is_ended:
            return
        self.is_ended = True
        self.process.kill()
        self.process.join()
        # the thread closes the pipe, after a `recv` that waits in it: a closed file's number may be another's by then
        self.thread.submit(self.connection.close)
        self.thread.shutdown(wait=False)
        self.process.close()


def _answer(connection: Connection, make: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """The side that answers, until the other one is gone."""
    leave_signals_to_parent()
    end_with_parent()  # a pipe that other processes hold too would not tell
    made = None
    while True:
        try:
            name, keywords = connection.recv()
        except EOFError:
            return
        try:
            with reported_to(_Teller(connection)), worded_for_page():
                made = make(*arguments) if made is None else made
                answer = ("done", getattr(made, name)(**keywords))
        except (CharNeRFError, OSError) as error:
            answer = ("refused", error_words(error))
        except Exception as error:
            traceback.print_exc(file=sys.stderr)
            answer = (
                "refused",
                f"{type(error).__name__}: {error}. This is a fault of charnerf; its log says where.",
            )
        try:
            connection.send(answer)
        except OSError:
            return


@final
class _Teller:
    """Tells moments to the other side, not more often than anybody looks."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.stage, self.time = "", 0.0

    def __call__(self, moment: Moment) -> None:
        now = time.monotonic()
        if moment.stage != self.stage or now - self.time >= TELL_EVERY:
            self.stage, self.time = moment.stage, now
            self.connection.send(("moment", moment))
