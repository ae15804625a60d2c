"""The page of `charnerf watch` in a real browser: it refreshes itself and tells the dead from the living."""

import threading

import pytest
import torch
import yaml
from torch.utils.tensorboard import SummaryWriter

from charnerf.training.run_lock import RunLock
from charnerf.watching.folder import WatchedFolder
from charnerf.watching.server import WatchServer

pytestmark = pytest.mark.browser


class Training:
    """A run that writes as a training does."""

    def __init__(self, folder) -> None:
        self.folder = folder
        folder.mkdir(parents=True)
        config = {"name": "run", "seed": 0, "budget": {"steps": 100, "seconds": None}}
        (folder / "config.yaml").write_text(yaml.safe_dump(config))
        self.writer = SummaryWriter(str(folder / "tensorboard"))

    def go_on(self, step: int, *, psnr: float, phase: int = 0) -> None:
        """Write what a validation writes."""
        values = {
            "train/loss/total": 1.0 / step,
            "train/seconds": step / 2.0,
            "val/psnr_foreground": psnr,
            "train/lr": 1e-3,
        }
        values |= {"attention/front": 0.7, "attention/side": 0.3, "train/left_out/rays": 0.4}
        for tag, value in values.items():
            self.writer.add_scalar(tag, value, step)
        self.writer.add_scalar(f"by_milliseconds/psnr_foreground/phase_{phase}", psnr, 500 * step)
        self.writer.add_image("val/target_prediction_error_depth_opacity/0", torch.rand(3, 32, 160), step)
        self.writer.flush()


@pytest.fixture
def grid(tmp_path):
    """A grid of two runs, one of which trains, and the address of its page."""
    runs = [Training(tmp_path / "grid" / name) for name in ("a", "b")]
    runs[0].go_on(20, psnr=12.0)
    with RunLock(runs[0].folder) as lock, WatchServer(WatchedFolder(tmp_path / "grid"), 0) as server:
        lock.take()
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        yield runs, server
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("page", ["", "a"])
def test_a_watched_page_reads_well(grid, open_page, page, width, scheme):
    _, server = grid
    opened = open_page(f"{server.address}{page}", width=width, color_scheme=scheme)
    opened.page.locator("figure.plot .main-svg").first.wait_for()
    assert not opened.is_wider_than_its_window()
    assert opened.serious_findings() == []
    assert opened.complaints == []
    assert {url.partition("?")[0] for url in opened.requests} <= {f"{server.address}{page}"}


def test_a_page_refreshes_itself_and_keeps_what_did_not_change(grid, open_page):
    runs, server = grid
    opened = open_page(f"{server.address}a")
    opened.page.get_by_text("Trains, 20 %").wait_for()
    opened.page.evaluate("document.querySelector('h1').kept = true")
    runs[0].go_on(40, psnr=15.5)
    opened.page.get_by_text("Trains, 40 %").wait_for()
    runs[0].go_on(60, psnr=17.0, phase=1)
    opened.page.get_by_text("17.00 dB on the foreground").wait_for()
    opened.page.locator(".legendtext", has_text="phase 1").first.wait_for()
    assert opened.page.evaluate("document.querySelector('h1').kept") is True
    assert opened.complaints == []


def test_diagrams_appear_on_a_page_that_had_none(grid, open_page):
    runs, server = grid
    page = open_page(f"{server.address}b").page
    page.get_by_text("Nothing is written yet").wait_for()
    runs[1].go_on(20, psnr=12.0)
    page.locator("figure.plot .main-svg").first.wait_for()


def test_the_dead_are_told_and_an_end_of_the_watching_is_said(grid, open_page):
    _, server = grid
    page = open_page(server.address).page
    page.get_by_text("b: nobody works on it").wait_for()
    page.get_by_role("link", name="a", exact=True).press("Enter")
    page.get_by_role("heading", name="a", exact=True).wait_for()
    server.shutdown()
    server.socket.close()
    page.get_by_text("charnerf watch does not answer").wait_for()
