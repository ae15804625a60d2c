"""The page of a watched folder over HTTP, for this machine alone."""

import sys
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, final
from urllib.parse import unquote

from charnerf.errors import CharNeRFError
from charnerf.hosts import host_name, is_known
from charnerf.watching.folder import WatchedFolder
from charnerf.watching.page import REPORT

HOME = "127.0.0.1"
NAMES = ("localhost",)
MOST_PAGES = 8  # kept: a whole one takes some MiB
HTML = "text/html; charset=utf-8"


@final
class WatchServer(ThreadingHTTPServer):
    """Serves a watched folder.

    Args:
        watched: The folder.
        port: 0 for a free one.

    Raises:
        OSError: If the port is taken.
    """

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, watched: WatchedFolder, port: int) -> None:
        self.watched = watched
        self.reading = threading.Lock()  # one request reads at a time
        self._pages: dict[tuple[str | None, bool], tuple[str, bytes]] = {}
        super().__init__((HOME, port), _Handler)

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HOME}:{self.server_address[1]}/"

    def page(self, name: str | None, *, whole: bool) -> tuple[str, bytes]:
        """Tag and content of a page, made anew where a file changed.

        Raises:
            KeyError: If there is no such run.
        """
        with self.reading:
            tag = self.watched.tag()
            before = self._pages.get((name, whole))
            if before is None or before[0] != tag:
                before = (
                    tag,
                    self.watched.page(name, whole=whole).encode("utf-8", errors="backslashreplace"),
                )
                self._pages[name, whole] = before
                if len(self._pages) > MOST_PAGES:
                    del self._pages[next(iter(self._pages))]
            return before

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Tell what failed; a page that was closed while it was answered has not."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


@final
class _Handler(BaseHTTPRequestHandler):
    """Answers GET: a page, its blocks, or a report that lies there."""

    server: WatchServer  # type: ignore[assignment]
    timeout = 10.0  # seconds for what is asked

    def do_GET(self) -> None:
        """Answer."""
        if not is_known(host_name(self.headers.get("Host", "")), NAMES):
            self._answer(HTTPStatus.FORBIDDEN, b"This page is for the machine that it runs on.", "text/plain")
            return
        path, _, query = self.path.partition("?")
        path = unquote(path, errors="surrogateescape")
        try:
            name, _, last = path.removeprefix("/").rpartition("/")
            if last == REPORT:
                self._report(name)
            else:
                self._page(path.removeprefix("/") or None, whole=query != "blocks")
        except (CharNeRFError, OSError) as error:
            self._answer(
                HTTPStatus.INTERNAL_SERVER_ERROR,
                str(error).encode(errors="replace"),
                "text/plain; charset=utf-8",
            )

    def _page(self, name: str | None, *, whole: bool) -> None:
        try:
            tag, content = self.server.page(name, whole=whole)
        except KeyError:
            self._missing()
            return
        if self.headers.get("If-None-Match") == f'"{tag}"':
            self._answer(HTTPStatus.NOT_MODIFIED, b"", HTML, tag=tag)
        else:
            self._answer(HTTPStatus.OK, content, HTML, tag=tag)

    def _report(self, name: str) -> None:
        file = self.server.watched.report(name)
        if file is None:
            self._missing()
        else:
            self._answer(HTTPStatus.OK, file.read_bytes(), HTML)

    def _missing(self) -> None:
        self._answer(HTTPStatus.NOT_FOUND, b"There is no such run, or no report of it yet.", "text/plain")

    def _answer(self, status: HTTPStatus, content: bytes, kind: str, *, tag: str | None = None) -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(content)), "Cache-Control": "no-store"}
        headers |= {
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
            "Referrer-Policy": "no-referrer",
        }
        headers |= {} if tag is None else {"ETag": f'"{tag}"'}
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: Any) -> None:
        """Requests are not told."""
