"""A search goes on from its journal, leaves failures for the next call, and names those that no other beats in both."""

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import pytest
from omegaconf import DictConfig, OmegaConf

from charnerf.config.search_space import Choice, Interval, SearchSpace
from charnerf.errors import ConfigError
from charnerf.training.cells import cells_of
from charnerf.training.search import Search, color_error

ROOT = Path(__file__).resolve().parents[2]
LATER = ("psnr_union", "lpips_vgg", "haze", "parts_lost")  # figures that the file does not have
METRICS = dict.fromkeys(LATER) | json.loads(
    (ROOT / "docs/weights/metrics_real_characters.json").read_text(encoding="utf-8")
)
METRICS |= {"per_character": {}, "baselines": {}}
SPACE = SearchSpace((), {"width": Choice(("1", "2", "4")), "waste": Interval(1.0, 3.0, False, False)})


def compose(overrides: list[str]) -> DictConfig:
    return OmegaConf.merge({"name": "run", "ckpt_path": None, "seed": 0}, OmegaConf.from_dotlist(overrides))


class Training:
    """Of a known front: wider ones err less and take longer, and what is wasted takes time alone."""

    def __init__(self, *, fails_at: int | None = None) -> None:
        self.asked: list[dict] = []
        self.fails_at = fails_at

    def __call__(self, cfg: DictConfig, folder: Path) -> None:
        self.asked.append({"width": cfg.width, "waste": cfg.waste})
        if len(self.asked) == self.fails_at:
            raise MemoryError("full")
        seconds = METRICS["seconds"] | {"render_per_frame": cfg.width * cfg.waste}
        metrics = METRICS | {"psnr_foreground": 20.0 * math.log10(cfg.width), "seconds": seconds}
        (folder / "metrics.json").write_text(json.dumps(metrics))


def search(folder: Path, space: SearchSpace = SPACE, **more: str) -> Search:
    return Search(folder, space, **{"seconds": "render_per_frame", "seed": 0} | more)  # type: ignore[arg-type]


def test_the_front_is_what_no_other_beats_in_both(tmp_path: Path) -> None:
    training = Training()
    one = search(tmp_path)
    one.run(14, compose, train=training)
    assert len(training.asked) == 14 and {ask["width"] for ask in training.asked} == {1, 2, 4}
    with one.write_front().open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["width"] for row in rows] == ["1", "2", "4"]
    for row in rows:
        assert float(row["error"]) == pytest.approx(1.0 / float(row["width"]), rel=1e-4)
        least = min(ask["waste"] for ask in training.asked if ask["width"] == int(row["width"]))
        assert float(row["waste"]) == least
        assert float(row["seconds.render_per_frame"]) == pytest.approx(least * int(row["width"]), rel=1e-3)


def test_a_search_goes_on_as_the_straight_one(tmp_path: Path) -> None:
    """Ended in the middle: what failed is tried again, what was done is kept, what follows is the same."""
    straight, cut, again, done = Training(), Training(fails_at=3), Training(), Training()
    search(tmp_path / "straight").run(6, compose, train=straight)
    search(tmp_path / "cut").run(3, compose, train=cut)
    assert sorted(cell.state for cell in cells_of(tmp_path / "cut")) == ["done", "done", "failed"]
    search(tmp_path / "cut").run(6, compose, train=again)
    assert again.asked[0] == cut.asked[2]
    assert [*cut.asked[:2], *again.asked] == straight.asked
    assert search(tmp_path / "cut").front() == search(tmp_path / "straight").front()
    search(tmp_path / "cut").run(6, compose, train=done)
    assert not done.asked


def test_a_folder_holds_one_search(tmp_path: Path) -> None:
    search(tmp_path)
    with pytest.raises(ConfigError, match=r'holds another search \(\["free width"\] differ\)'):
        search(tmp_path, SearchSpace((), SPACE.free | {"width": Choice(("1", "8"))}))
    with pytest.raises(ConfigError, match="seconds"):
        search(tmp_path, seconds="mesh")
    with pytest.raises(ConfigError, match="fixed"):
        search(tmp_path, SearchSpace(("seed=1",), SPACE.free))


def test_errors_are_those_of_psnr() -> None:
    assert color_error({"psnr_foreground": 20.0}) == pytest.approx(0.1)
    assert color_error({"psnr_foreground": None}) is None


@pytest.mark.slow
def test_the_command_of_the_page(figure_dataset: Path, tmp_path: Path) -> None:
    short = ["scale=smoke", "trainer=cpu", "data=folder", f"data.root={figure_dataset}", "scale.eval_views=1"]
    short += ["scale.steps=2", "validation.times=1", "encoder=single", "combinator=mean,sa", "-o", "found"]
    for trials, rows in (("1", 2), ("3", 2)):
        command = [sys.executable, "-m", "charnerf", "search", *short, "--trials", trials]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / "found/report.md").is_file()
        assert len((tmp_path / "found/front.csv").read_text().splitlines()) >= rows
