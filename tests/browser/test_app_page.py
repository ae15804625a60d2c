"""The page of `charnerf app` in a real browser: everything that can be done on it, with the egg for a model."""

import asyncio
import multiprocessing
import os
import re
import struct
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from PIL import Image

from charnerf.app.limits import Limits
from charnerf.app.server import serving
from charnerf.app.settings import read_plan
from charnerf.app.studio import Studio, process_context
from support.app_server import QUICK
from support.egg_model import FakeModel, draw_eggs

pytestmark = pytest.mark.browser
MOST_WAITS = 4000  # of 50 ms each: what hangs ends


@dataclass
class Running:
    """A server in a thread of its own.

    Attributes:
        folder: Its files.
        address: Of the page.
        studio: What does the work.
    """

    folder: Path
    address: str = ""
    studio: Studio | None = None
    begun: threading.Event = field(default_factory=threading.Event)
    loop: asyncio.AbstractEventLoop | None = None

    def serve(self) -> None:
        """Until its loop is stopped."""

        async def story() -> None:
            self.loop = asyncio.get_running_loop()
            self.ended = asyncio.Event()
            limits = Limits(grace_s=0.5, keep_s=600.0)
            self.studio = Studio(self.folder, FakeModel, process_context(), limits)
            async with serving(self.studio, "127.0.0.1", 0, ()) as (host, port):
                self.address = f"http://{host}:{port}/"
                self.begun.set()
                await self.ended.wait()

        asyncio.run(story())


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[Running]:
    running = Running(tmp_path_factory.mktemp("work"))
    thread = threading.Thread(target=running.serve)
    thread.start()
    assert running.begun.wait(60)
    yield running
    running.loop.call_soon_threadsafe(running.ended.set)
    thread.join()
    assert list(running.folder.iterdir()) == []
    assert multiprocessing.active_children() == []


@pytest.fixture(scope="module")
def eggs(tmp_path_factory) -> dict[str, Path]:
    return draw_eggs(tmp_path_factory.mktemp("eggs"))


@pytest.fixture(scope="module")
def sheet(eggs, tmp_path_factory) -> Path:
    """The three eggs in one picture."""
    pictures = [Image.open(file) for file in eggs.values()]
    page = Image.new("RGB", (600, 260), "white")
    for index, picture in enumerate(pictures):
        page.paste(picture, (200 * index, 0))
    file = tmp_path_factory.mktemp("sheet") / "sheet.png"
    page.save(file)
    return file


def until(page, expression: str, arg=None) -> None:
    """Wait until an expression holds; what playwright waits by, the page's policy forbids."""
    for _ in range(MOST_WAITS):
        if page.evaluate(expression, arg):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"never: {expression}: {page.evaluate('JSON.stringify(state)')}")


def opened_on(server, open_page, **options):
    """The page, ready to be used."""
    opened = open_page(server.address, **options)
    opened.page.locator("#examples button").first.wait_for()
    until(opened.page, "location.hash.length > 20")
    return opened


def give(page, *files: Path) -> None:
    """Choose pictures, and wait until they are read."""
    page.set_input_files("#files", [str(file) for file in files])
    until(page, f"state.pictures.length === {len(files)} && !state.busy")


def fill(page, **more) -> None:
    """Ask for something small."""
    page.locator("#settings summary").click()
    for name, value in {**QUICK, **more}.items():
        page.fill(f"#field-{name}", str(value))
    page.locator("#settings summary").click()


def build(page) -> None:
    begin(page)
    until(page, "!isActive()")
    assert page.evaluate("state.job.state") == "done", page.evaluate("state.job.problem")


def begin(page) -> None:
    """Press the button, and wait until the server has taken the job."""
    number = page.evaluate("state.job?.number ?? 0")
    page.click("#build")
    until(page, f"(state.job?.number ?? 0) > {number}")


def views(page) -> list[str]:
    return page.evaluate("state.figures.map((one) => one.view)")


def test_three_drawings_to_a_character_that_is_taken_away(server, open_page, eggs, tmp_path):
    opened = opened_on(server, open_page)
    page = opened.page
    give(page, *eggs.values())
    assert views(page) == ["front", "left", "back"]
    page.get_by_label("View of side.png").select_option("right")
    until(page, "!state.busy && state.read?.views[1].view === 'right'")
    fill(page, levels="300")
    build(page)
    canvas = page.locator("charnerf-mesh canvas")
    canvas.wait_for()
    for kind in ("Clay", "Wireframe", "Textured"):
        page.get_by_role("button", name=kind).click()
    page.get_by_label("Level of detail").select_option("mesh_LOD1.glb")
    canvas.wait_for()
    page.get_by_role("tab", name="Field").click()
    first = seen(page)
    page.locator("#azimuth").focus()
    page.keyboard.press("PageUp")
    assert seen(page, other_than=first) != first
    page.get_by_role("button", name="Turning").last.click()
    until(
        page, f"Number(document.getElementById('azimuth').value) !== {page.locator('#azimuth').input_value()}"
    )
    page.get_by_role("tab", name="Turntable").click()
    page.get_by_role("tab", name="Sheet").click()
    names = page.locator("#downloads a").evaluate_all("links => links.map((link) => link.download)")
    assert {"mesh.glb", "mesh_obj.zip", "mesh.usdz", "levels.zip", "sheet.png"} < set(names)
    with page.expect_download() as download:
        page.get_by_role("link", name="mesh.glb").click()
    download.value.save_as(tmp_path / "mesh.glb")
    content = (tmp_path / "mesh.glb").read_bytes()
    assert struct.unpack("<4sII", content[:12]) == (b"glTF", 2, len(content))
    assert opened.complaints == []
    assert [url for url in opened.requests if not url.startswith((server.address, "blob:"))] == []
    with page.context.expect_page() as report:
        page.get_by_role("link", name="Open the report").click()
    check_report(report.value, page.evaluate("location.hash.slice(1)"))


def check_report(report, session: str) -> None:
    """It draws its mesh by its own script, and reaches neither the page that opened it nor a session."""
    report.locator("charnerf-mesh canvas").wait_for()
    assert report.evaluate("[origin, opener]") == ["null", None]
    asked = (
        "(session) => fetch(`/sessions/${session}/look?azimuth=0&elevation=0&size=64`).then(() => 1, () => 0)"
    )
    assert report.evaluate(asked, session) == 0


def seen(page, other_than: str = "") -> str:
    """The picture of the field, once it is there."""
    until(
        page,
        "(before) => looked && !asking && document.getElementById('look').src !== before",
        arg=other_than,
    )
    return page.locator("#look").get_attribute("src")


def test_a_sheet_is_taken_apart_and_corrected_from_the_keyboard(server, open_page, sheet):
    """Swapping, mirroring and leaving out, by keys alone."""
    page = opened_on(server, open_page).page
    give(page, sheet)
    assert page.locator(".sheet .box").count() == 3
    assert sorted(views(page)) == ["back", "front", "left"] or sorted(views(page)) == [
        "back",
        "front",
        "right",
    ]
    before = views(page)
    for card in (0, 2):
        press(page, page.locator(".figure").nth(card).get_by_role("button", name="Swap"))
    order = "!state.busy && state.figures.map((one) => one.view).join()"
    until(page, f"{order} === '{','.join(before[::-1])}'")
    press(page, page.locator(".figure").nth(1).get_by_role("button", name="Leave out"))
    until(page, "!state.busy && state.figures[1].view === '' && state.read?.views.length === 2")
    press(page, page.locator(".figure").nth(0).get_by_role("button", name="Mirror"))
    until(page, "!state.busy && state.figures[0].mirrored")
    select = page.locator(".figure").nth(1).get_by_role("combobox")
    select.select_option("other")
    page.keyboard.type("45")
    page.keyboard.press("Tab")
    until(page, "!state.busy && state.figures[1].view === 'three-quarter-front'")
    press(page, page.get_by_role("button", name="Start over"))
    until(page, "!state.figures.length")
    assert page.locator("#build").is_disabled()


def press(page, button) -> None:
    button.focus()
    page.keyboard.press("Enter")


def test_a_wrong_file_is_answered_by_a_sentence(server, open_page, eggs, tmp_path):
    (tmp_path / "notes.png").write_text("no picture")
    page = opened_on(server, open_page).page
    page.set_input_files("#files", [str(tmp_path / "notes.png")])
    page.get_by_role("alert").filter(has_text="notes.png: found a file that is no picture").wait_for()
    give(page, eggs["front"])
    assert "There is one view so far, expected two or more" in page.locator("#missing").inner_text()


def test_users_queue_and_a_cancel_or_a_closed_page_lets_the_next_one_in(server, open_page, eggs):
    first, second, third = (opened_on(server, open_page).page for _ in range(3))
    for page in (first, second, third):
        give(page, *eggs.values())
        fill(page, frames=120, size=512)  # minutes: only a cancel ends it
        page.click("#build")
    third.get_by_text("2 characters are made before yours.").first.wait_for()
    press(first, first.get_by_role("button", name="Cancel"))
    until(second, "state.job.state === 'running'")
    third.get_by_text("One character is made before yours.").first.wait_for()
    second.close()
    until(third, "state.job.state === 'running'")
    third.click("#cancel")
    until(third, "state.job.state === 'cancelled'")
    assert first.evaluate("state.job.state") == "cancelled" and first.locator("#build").is_enabled()


@pytest.fixture(scope="module")
def made(server, eggs) -> str:
    """The address of a page whose character is made already."""

    async def story() -> str:
        studio = server.studio
        session = studio.open()
        studio.came(session)  # a job without a page is cancelled soon
        for index, drawing in enumerate(eggs.values()):
            file = studio.reader.new_picture(session, drawing.name)
            file.write_bytes(drawing.read_bytes())
            await studio.reader.add_picture(session, file, more=index < 2)
        while session.is_busy:
            await asyncio.sleep(0.05)
        studio.queue.build(session, read_plan(QUICK))
        while session.job.is_active:
            await asyncio.sleep(0.05)
        assert session.job.state == "done", session.job.problem
        studio.left(session)
        return f"{server.address}#{session.name}"

    return asyncio.run_coroutine_threadsafe(story(), server.loop).result()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_reads_well(server, made, open_page, width, scheme):
    for address in (server.address, made):
        opened = open_page(address, width=width, color_scheme=scheme)
        page = opened.page
        page.locator("#examples button").first.wait_for(state="attached")
        if address == made:
            page.locator("charnerf-mesh").scroll_into_view_if_needed()
            page.locator("charnerf-mesh canvas").wait_for()
            page.locator("#settings summary").click()
            page.get_by_role("tab", name="Field").click()
            seen(page)
        assert opened.serious_findings() == []
        assert not opened.is_wider_than_its_window()
        assert opened.complaints == []


def test_many_jobs_leave_memory_and_handles_as_they_were(server, open_page, eggs):
    """Fifty of them, most cancelled in the middle: what stays is what one leaves."""
    page = opened_on(server, open_page).page
    give(page, *eggs.values())
    session = server.studio.sessions[page.evaluate("session")]

    async def make(count: int, *, done: int) -> None:
        for index in range(count):
            server.studio.queue.build(session, read_plan(QUICK))
            while session.job.is_active:
                if index >= done and session.job.moment:
                    server.studio.queue.cancel(session)
                await asyncio.sleep(0.01)
            assert session.job.state == ("done" if index < done else "cancelled"), session.job.problem

    def run(story) -> None:
        asyncio.run_coroutine_threadsafe(story, server.loop).result()

    run(make(3, done=1))
    handles, memory = held()
    run(make(50, done=2))
    now = held()
    assert now[0] <= handles + 2 and now[1] <= memory + 20.0
    assert sorted(
        one.name[:4] for one in session.folder.iterdir() if one.is_dir() and not one.name.isdigit()
    ) == ["made", "read"]


def held() -> tuple[int, float]:
    """Open files and memory, MiB, of this process, in which the server runs."""
    time.sleep(0.5)
    status = Path("/proc/self/status").read_text()
    return len(os.listdir("/proc/self/fd")), int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024
