"""The page over HTTP: what it asks, what it is sent, and the stream that tells it of every change."""

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Collection
from contextlib import asynccontextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError

from charnerf.app.examples import EXAMPLES, example_files
from charnerf.app.guard import HEADERS, REPORT_HEADERS, refusal
from charnerf.app.received import MOST_TEXT, keep, said, title_of
from charnerf.app.session import Session, thumbnail_of
from charnerf.app.settings import Reading, form, read_plan
from charnerf.app.studio import Studio
from charnerf.app.worker import Refused
from charnerf.drawings.viewpoints import AZIMUTHS
from charnerf.errors import CharNeRFError, DataError
from charnerf.viewer.element import viewer_script

PAGE = {
    "/": ("charnerf.app", "page/index.html", "text/html"),
    "/app.js": ("charnerf.app", "page/app.js", "text/javascript"),
    "/app.css": ("charnerf.app", "page/app.css", "text/css"),
    "/page.css": ("charnerf.reporting", "page.css", "text/css"),
}
HEARTBEAT = 15.0  # seconds
LOOKS = range(32, 513)  # pixels a side
STUDIO: web.AppKey[Studio] = web.AppKey("studio", Studio)
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def make_app(studio: Studio, names: Collection[str]) -> web.Application:
    """The server's application.

    Args:
        studio: What does the work; it is closed with the application.
        names: Hosts that it is known by, beside numbers.
    """
    app = web.Application(middlewares=[_guarded(frozenset(names))], client_max_size=MOST_TEXT)
    app[STUDIO] = studio
    for path, (package, name, kind) in PAGE.items():
        app.router.add_get(path, _sending(files(package).joinpath(name).read_bytes(), kind))
    app.router.add_get("/viewer.js", _sending(viewer_script().encode(), "text/javascript"))
    app.router.add_get("/form", _form)
    app.router.add_get("/examples/{name}", _example_picture)
    app.router.add_post("/sessions", _open)
    session = "/sessions/{session}"
    app.router.add_get(f"{session}/events", _events)
    app.router.add_post(f"{session}/pictures", _add)
    app.router.add_delete(f"{session}/pictures/{{number}}", _remove)
    app.router.add_post(f"{session}/examples/{{name}}", _add_example)
    app.router.add_post(f"{session}/figures", _edit)
    app.router.add_post(f"{session}/build", _build)
    app.router.add_post(f"{session}/cancel", _cancel)
    app.router.add_get(f"{session}/look", _look)
    app.router.add_get(f"{session}/pictures/{{number}}", _thumbnail)
    app.router.add_get(f"{session}/figures/{{number}}", _figure)
    app.router.add_get(f"{session}/read/{{folder}}/{{name}}", _read_picture)
    app.router.add_get(f"{session}/made/{{folder}}/{{name}}", _made_file)
    app.cleanup_ctx.append(_closing)
    return app


async def _closing(app: web.Application) -> AsyncIterator[None]:
    yield
    app[STUDIO].close()


@asynccontextmanager
async def serving(
    studio: Studio, host: str, port: int, names: Collection[str]
) -> AsyncIterator[tuple[str, int]]:
    """Serve the page meanwhile.

    Yields:
        The address and the port it is served at: a free one where the port is 0.

    Raises:
        OSError: If it can not be served there.
    """
    runner = web.AppRunner(
        make_app(studio, names),
        handler_cancellation=True,
        access_log=None,
        logger=_log_of_faults(),
        shutdown_timeout=1.0,
    )
    await runner.setup()
    try:
        await web.TCPSite(runner, host, port).start()
        address = runner.addresses[0]
        yield str(address[0]), int(address[1])
    finally:
        await runner.cleanup()


def _log_of_faults() -> logging.Logger:
    """Tells faults of the server, not requests that are none of HTTP, nor pages that are closed."""

    def is_fault(record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        return not isinstance(error, HttpProcessingError | web.RequestPayloadError | ConnectionError)

    log = logging.getLogger("charnerf.app")
    log.filters = [is_fault]
    return log


def _guarded(names: Collection[str]) -> Callable[..., Any]:
    """What stands before every answer: who may ask; errors are a sentence."""

    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        why = refusal(request.method, request.headers, names)
        if why is not None:
            return _problem(403, why)
        try:
            return await handler(request)
        except ConnectionError:
            raise  # the page is closed
        except (CharNeRFError, Refused, OSError, web.HTTPException, web.RequestPayloadError) as error:
            return _problem(*_answer_to(error))

    return guard


def _answer_to(error: Exception) -> tuple[int, str]:
    """Status and sentence of an error."""
    match error:
        case web.HTTPRequestEntityTooLarge():
            return 413, f"found more than {MOST_TEXT} bytes, expected fewer. Load the page again."
        case web.HTTPException():
            return error.status, error.text or error.reason
        case web.RequestPayloadError():
            return (
                400,
                "found a body that can not be read, expected a whole and plain one. Load the page again.",
            )
        case OSError():
            return (
                507,
                f"This machine can not keep it ({error.strerror}). Make room on its disk, and try again.",
            )
    return 400, str(error)


def _problem(status: int, sentence: str) -> web.Response:
    return web.json_response({"error": sentence}, status=status, headers=HEADERS)


def _sending(content: bytes, kind: str) -> Handler:
    """What sends one of the page's own files."""

    async def send(request: web.Request) -> web.Response:
        return web.Response(body=content, content_type=kind, charset="utf-8", headers=HEADERS)

    return send


async def _form(request: web.Request) -> web.Response:
    limits = request.app[STUDIO].limits
    content = {
        "fields": form(),
        "views": list(AZIMUTHS),
        "examples": {name: one.title for name, one in EXAMPLES.items()},
        "limits": {"upload": limits.upload, "pictures": limits.pictures},
    }
    return web.json_response(content, headers=HEADERS)


async def _example_picture(request: web.Request) -> web.StreamResponse:
    name = request.match_info["name"]
    if name not in EXAMPLES:
        raise web.HTTPNotFound(text="There is no such example.")
    return web.FileResponse(example_files(name)[0], headers=HEADERS)


async def _open(request: web.Request) -> web.Response:
    return web.json_response({"session": request.app[STUDIO].open().name}, headers=HEADERS)


def _session(request: web.Request) -> Session:
    session = request.app[STUDIO].sessions.get(request.match_info["session"])
    if session is None:
        raise web.HTTPNotFound(
            text="This page's work is not there any more. Load the page again to begin anew."
        )
    return session


async def _events(request: web.Request) -> web.StreamResponse:
    """All that the page shows, again whenever it has changed; that it is read says that the page is open."""
    studio, session = request.app[STUDIO], _session(request)
    response = web.StreamResponse(headers={**HEADERS, "Content-Type": "text/event-stream"})
    changed = asyncio.Event()
    session.listeners.add(changed)
    studio.came(session)
    try:
        await response.prepare(request)
        while session.name in studio.sessions:
            changed.clear()
            state = json.dumps(session.state(studio.queue.place(session)))
            await response.write(f"data: {state}\n\n".encode())
            while not await _is_set(changed, HEARTBEAT):
                await response.write(b": still there\n\n")
    except ConnectionError:
        pass  # the page is closed
    finally:
        session.listeners.discard(changed)
        studio.left(session)
    return response


async def _is_set(event: asyncio.Event, seconds: float) -> bool:
    """Whether an event is set within a time."""
    try:
        await asyncio.wait_for(event.wait(), seconds)
    except TimeoutError:
        return False
    return True


async def _add(request: web.Request) -> web.Response:
    """A picture, as the request's whole body."""
    studio, session = request.app[STUDIO], _session(request)
    file = studio.reader.new_picture(session, title_of(request.query.get("name", "")))
    await keep(request, file, most=studio.limits.upload, silence_s=studio.limits.silence_s)
    await studio.reader.add_picture(session, file, more="more" in request.query)
    return _done()


async def _add_example(request: web.Request) -> web.Response:
    studio, session, name = request.app[STUDIO], _session(request), request.match_info["name"]
    if name not in EXAMPLES:
        raise web.HTTPNotFound(text="There is no such example.")
    for picture in list(session.pictures):
        studio.reader.remove_picture(session, picture.number)
    pictures = example_files(name)
    for index, picture_file in enumerate(pictures):
        file = studio.reader.new_picture(session, picture_file.name)
        file.write_bytes(picture_file.read_bytes())
        await studio.reader.add_picture(session, file, more=index + 1 < len(pictures))
    return _done()


async def _remove(request: web.Request) -> web.Response:
    request.app[STUDIO].reader.remove_picture(_session(request), _number(request.match_info["number"]))
    return _done()


async def _edit(request: web.Request) -> web.Response:
    """Names, left-out and mirrored figures; how drawings are read."""
    session, words = _session(request), await said(request, request.app[STUDIO].limits.silence_s)
    changes, reading = words.get("figures", {}), words.get("reading")
    if not isinstance(changes, dict) or not all(
        isinstance(one, dict) and isinstance(one.get("view"), str) and isinstance(one.get("mirrored"), bool)
        for one in changes.values()
    ):
        raise DataError(
            "figures: found something else, expected view and mirrored by number. Load the page again."
        )
    if reading is not None:
        reading = read_plan(reading).reading
    read: Reading | None = reading
    request.app[STUDIO].reader.edit(
        session, {_number(number): (one["view"], one["mirrored"]) for number, one in changes.items()}, read
    )
    return _done()


async def _build(request: web.Request) -> web.Response:
    request.app[STUDIO].queue.build(
        _session(request), read_plan(await said(request, request.app[STUDIO].limits.silence_s))
    )
    return _done()


async def _cancel(request: web.Request) -> web.Response:
    request.app[STUDIO].queue.cancel(_session(request))
    return _done()


async def _look(request: web.Request) -> web.Response:
    session = _session(request)
    try:
        azimuth, elevation = float(request.query["azimuth"]), float(request.query["elevation"])
        size = int(request.query["size"])
    except (KeyError, ValueError) as error:
        raise DataError(
            "look: expected azimuth, elevation and size as numbers. Load the page again."
        ) from error
    if size not in LOOKS or not abs(azimuth) <= 720.0 or not abs(elevation) <= 90.0:
        raise DataError(
            f"look: found {azimuth}, {elevation}, {size}, expected angles and a size. Load the page again."
        )
    picture = await request.app[STUDIO].queue.look(
        session, azimuth_deg=azimuth, elevation_deg=elevation, size=size, moving="moving" in request.query
    )
    return web.Response(body=picture, content_type="image/png", headers=HEADERS)


async def _thumbnail(request: web.Request) -> web.StreamResponse:
    session, number = _session(request), _number(request.match_info["number"])
    for picture in session.pictures:
        if picture.number == number:
            return _file(picture.thumbnail)
    raise web.HTTPNotFound(text="This picture is not there any more.")


async def _figure(request: web.Request) -> web.StreamResponse:
    """A small picture of a figure as it came."""
    session, number = _session(request), _number(request.match_info["number"])
    for figure in session.figures:
        if figure.number == number:
            small = thumbnail_of(figure.file)
            return _file(small if figure.part is None else small.with_stem(f"{small.stem}-{figure.part}"))
    raise web.HTTPNotFound(text="This figure is not there any more.")


async def _read_picture(request: web.Request) -> web.StreamResponse:
    """A picture of how a view was read."""
    session, name = _session(request), request.match_info["name"]
    read = () if session.recognized is None else session.recognized.views
    known = {file for one in read for file in (one.given, one.mended) if file is not None}
    return _file(_known(session.recognized_in, request.match_info["folder"], name, known))


async def _made_file(request: web.Request) -> web.StreamResponse:
    """A file of what was made; `?save` saves it."""
    session, name = _session(request), request.match_info["name"]
    product = session.product
    known = set() if product is None else {*product.files, *(level.file for level in product.levels)}
    file = _known(session.made_in, request.match_info["folder"], name, known)
    if "save" in request.query:
        return _file(file, {"Content-Disposition": f'attachment; filename="{name}"'})
    return _file(file, REPORT_HEADERS if file.suffix == ".html" else {})


def _known(folder: Path | None, folder_name: str, name: str, known: Collection[str]) -> Path:
    """A file that was told of, and no other."""
    if folder is None or folder.name != folder_name or name not in known or not (folder / name).is_file():
        raise web.HTTPNotFound(text="This file is not there any more.")
    return folder / name


def _file(path: Path, headers: dict[str, str] | None = None) -> web.FileResponse:
    return web.FileResponse(path, headers={**HEADERS, **(headers or {})})


def _done() -> web.Response:
    return web.json_response({}, headers=HEADERS)


def _number(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise web.HTTPNotFound(text="There is no such picture.")
    return int(text)
