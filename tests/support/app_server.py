"""The server of `charnerf app` in a test, with the egg for a model, and what talks to it as its page does."""

import asyncio
import json
import multiprocessing
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import aiohttp

from charnerf.app.limits import Limits
from charnerf.app.server import serving
from charnerf.app.studio import Studio
from support.egg_model import FakeModel

QUICK = {"resolution": 32, "faces": 600, "texture_size": 128, "frames": 2, "size": 64}


class Page:
    """One page: a session, and what the server told of it last."""

    def __init__(self, client: aiohttp.ClientSession, session: str) -> None:
        self.client, self.session = client, session
        self.state: dict[str, Any] = {}
        self.events: Any = None

    async def open(self) -> "Page":
        """Begin to listen."""
        self.events = await self.client.get(f"/sessions/{self.session}/events")
        assert self.events.status == 200
        await self.wait(lambda state: True)
        return self

    def close(self) -> None:
        """Close it, as a browser does."""
        self.events.close()

    async def wait(self, until: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Listen until what is told is so."""
        async for line in self.events.content:
            if line.startswith(b"data: "):
                self.state = json.loads(line[6:])
                if until(self.state):
                    return self.state
        raise AssertionError(f"the stream ended: {self.state}")

    async def ask(self, method: str, path: str, **more: Any) -> tuple[int, Any]:
        """Status and content."""
        async with self.client.request(method, f"/sessions/{self.session}/{path}", **more) as answer:
            content = await answer.read()
            return answer.status, json.loads(
                content
            ) if answer.content_type == "application/json" else content

    async def give(self, *files: Path) -> list[tuple[int, Any]]:
        """Drop pictures."""
        return [
            await self.ask(
                "POST",
                f"pictures?name={quote(file.name)}{'' if file is files[-1] else '&more'}",
                data=file.read_bytes(),
            )
            for file in files
        ]

    async def read(self) -> dict[str, Any]:
        """Wait until all pictures are read."""
        return await self.wait(lambda state: state["figures"] and not state["busy"])

    async def finished(self) -> dict[str, Any]:
        """Wait until the job is over."""
        return await self.wait(
            lambda state: state["job"] and state["job"]["state"] not in ("waiting", "running")
        )


@asynccontextmanager
async def app_server(
    folder: Path, *, load: Callable[[], Any] = FakeModel, limits: Limits | None = None, method: str = "fork"
) -> AsyncIterator[tuple[Studio, Callable[[], Any]]]:
    """The server, and what opens pages on it."""
    studio = Studio(folder, load, multiprocessing.get_context(method), limits)
    async with serving(studio, "127.0.0.1", 0, {"localhost"}) as (host, port):
        address = f"http://{host}:{port}"
        async with aiohttp.ClientSession(address, headers={"Origin": address}) as client:

            async def open_page() -> Page:
                async with client.post("/sessions") as answer:
                    return await Page(client, (await answer.json())["session"]).open()

            yield studio, open_page
    assert list(folder.iterdir()) == []  # whatever happened, it takes its files with it
    for _ in range(100):
        if not multiprocessing.active_children():
            return
        await asyncio.sleep(0.05)
    raise AssertionError("processes are left")
