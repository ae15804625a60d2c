"""What a request brings: bounded in size, and in how long it may say nothing."""

import asyncio
import json
from collections.abc import Awaitable
from pathlib import Path
from typing import Any, TypeVar

from aiohttp import web

from charnerf.errors import DataError

MOST_TEXT = 64 * 1024  # bytes of what the page says
MOST_NAME = 120  # signs of a file's name
_PIECE = 2**16  # bytes
Heard = TypeVar("Heard")


async def said(request: web.Request, silence_s: float) -> dict[str, Any]:
    """What the page says, an object of JSON in UTF-8.

    Raises:
        DataError: If it is something else, or does not come.
        web.HTTPRequestEntityTooLarge: If it is too long.
    """
    text = await _heard(request.read(), silence_s)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DataError("found no JSON, expected an object. Load the page again.") from error
    if not isinstance(content, dict):
        raise DataError("found no object of JSON, expected one. Load the page again.")
    return content


async def keep(request: web.Request, file: Path, *, most: int, silence_s: float) -> None:
    """Write the request's whole body to a file in a folder of its own; both go if it can not be had.

    Args:
        request: What brings it.
        file: Where it goes; messages name it.
        most: Bytes.
        silence_s: Seconds in which nothing has come after which the rest is not waited for.

    Raises:
        DataError: If it is larger, or does not come.
        OSError: If it can not be written.
    """
    try:
        size = request.content_length or 0  # as it is said
        with file.open("wb") as stream:
            while size <= most and (piece := await _heard(request.content.read(_PIECE), silence_s)):
                stream.write(piece)
                size = max(size, stream.tell())
        if size > most:
            raise DataError(
                f"{file.name}: found more than {most // 2**20} MiB, expected fewer. Save it smaller, as PNG or JPEG."
            )
    except BaseException:
        file.unlink(missing_ok=True)
        file.parent.rmdir()
        raise


async def _heard(coming: Awaitable[Heard], silence_s: float) -> Heard:
    try:
        return await asyncio.wait_for(coming, silence_s)
    except TimeoutError as error:
        raise DataError(
            f"found nothing more for {silence_s:g} seconds, expected the rest. Look at the connection, and try again."
        ) from error


def title_of(name: str) -> str:
    """A file's name that is one, and nothing else: no path, no hidden file, nothing that can not be printed."""
    name = "".join(sign for sign in name.replace("\\", "/").rpartition("/")[2] if sign.isprintable())
    name = name.lstrip(". ")
    while len(name.encode("utf-8", "ignore")) > MOST_NAME:
        name = name[:-1]
    return name.encode("utf-8", "ignore").decode() or "drawing"
