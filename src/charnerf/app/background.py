"""Pieces of work in the server's thread that nobody waits for."""

import asyncio
from collections.abc import Coroutine
from typing import Any, final


@final
class Background:
    """Holds them until they are done: the loop alone would let them go."""

    def __init__(self) -> None:
        self.tasks: set[asyncio.Task[None]] = set()

    def begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Begin a piece of work."""
        task = asyncio.get_running_loop().create_task(work)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    def cancel(self) -> None:
        """End all of them where they wait."""
        for task in self.tasks:
            task.cancel()
