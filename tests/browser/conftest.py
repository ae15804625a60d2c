"""Debian's Chromium, driven by playwright: opt in by `-m browser`."""

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


@dataclass
class Opened:
    """A page, with what it complained of and asked for since it was opened.

    Attributes:
        page: Of playwright.
        complaints: Errors on its console, and those that nothing caught.
        requests: Addresses asked for, but what the page holds itself.
    """

    page: Any
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def is_wider_than_its_window(self) -> bool:
        """Whether it scrolls sideways."""
        return self.page.evaluate("document.documentElement.scrollWidth > innerWidth")

    def serious_findings(self) -> list[str]:
        """What axe finds that keeps people out, one line each."""
        from axe_playwright_python.sync_playwright import Axe

        found = Axe().run(self.page).response["violations"]
        return [
            f"{one['id']}: {one['help']}: {one['nodes'][0]['html'][:120]}"
            for one in found
            if one["impact"] in ("serious", "critical")
        ]


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser; skips with the reason where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no playwright: pip install -e '.[browser]'"
    )
    pytest.importorskip("axe_playwright_python", reason="no axe: pip install -e '.[browser]'")
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip(f"no browser: found none of {', '.join(NAMES)}; apt-get install chromium")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture
def open_page(chromium) -> Iterator[Callable[..., Opened]]:
    """Opens a file or an address in a window of its own; more options are those of playwright's contexts."""
    contexts = []

    def open_(where: Path | str, *, width: int = 1280, **options: Any) -> Opened:
        context = chromium.new_context(viewport={"width": width, "height": 844}, **options)
        contexts.append(context)
        opened = Opened(context.new_page())
        opened.page.on(
            "console", lambda one: opened.complaints.append(one.text) if one.type == "error" else None
        )
        opened.page.on("pageerror", lambda error: opened.complaints.append(str(error)))
        address = where.as_uri() if isinstance(where, Path) else where
        opened.page.on(
            "request", lambda one: opened.requests.append(one.url) if asks(one.url, address) else None
        )
        opened.page.goto(address)
        return opened

    def asks(url: str, address: str) -> bool:
        return url != address and not url.startswith(("data:", "blob:"))

    yield open_
    for context in contexts:
        context.close()
