"""A search goes on from its journal, leaves failures for the next call, and names those that no other beats in both."""

import csv
import json
import math
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from omegaconf import DictConfig, OmegaConf

from charnerf.config.search_space import Choice, Interval, SearchSpace
from charnerf.errors import ConfigError, DataError
from charnerf.interruption import Stopped
from charnerf.training.cells import cells_of
from charnerf.training.search import JOURNAL, Search, color_error

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


def journal(folder: Path, *records: dict) -> None:
    """Append to a journal, as its format allows anybody."""
    with (folder / JOURNAL).open("a") as file:
        file.writelines(json.dumps({"worker_id": "stranger", **one}) + "\n" for one in records)


def begun(**chosen: tuple[object, object]) -> dict:
    """A run that was begun: operation 4, a trial of study 0, with values and distributions."""
    return {
        "op_code": 4,
        "study_id": 0,
        "datetime_start": "2026-01-01T00:00:00.000000",
        "state": 0,
        "params": {key: value for key, (value, _) in chosen.items()},
        "distributions": {key: kind.replace("'", '"') for key, (_, kind) in chosen.items()},
        "user_attrs": {},
        "system_attrs": {},
        "intermediate_values": {},
    }


ANY = "{'name': 'CategoricalDistribution', 'attributes': {'choices': ['[subprocess]', 'subprocess.Popen', '8']}}"
WASTE = (
    2.0,
    "{'name': 'FloatDistribution', 'attributes': {'low': 1.0, 'high': 3.0, 'step': null, 'log': false}}",
)


@pytest.mark.parametrize(
    "chosen",
    [
        {"width": (2, ANY), "waste": WASTE},
        {"width": (2, ANY)},
        {"trusted_targets": (0, ANY), "encoder._target_": (1, ANY)},
    ],
    ids=["a value", "one is missing", "another key"],
)
def test_a_strangers_journal_adds_nothing_to_the_command_line(tmp_path: Path, chosen: dict) -> None:
    search(tmp_path)
    journal(tmp_path, begun(**chosen))
    training = Training()
    with pytest.raises(DataError, match=r"search\.log: run 0: found .*, expected a choice of width, waste"):
        search(tmp_path).run(2, compose, train=training)
    assert not training.asked


@pytest.mark.parametrize(
    "content", [b"\xff\n{}\n", b"[]\n{}\n", b'{"op_code": 99}\n', b"{}\n" + b"{\n" * 2, b"[" * 5000 + b"\n\n"]
)
def test_a_broken_journal_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / JOURNAL).write_bytes(content)
    with pytest.raises(DataError, match=r"search\.log: can not be read"):
        search(tmp_path)


def test_a_line_that_a_full_disk_cut_off_is_left_out(tmp_path: Path) -> None:
    search(tmp_path).run(2, compose, train=Training())
    with (tmp_path / JOURNAL).open("ab") as file:
        file.write(b'{"op_code": 6, "wor')
    training = Training()
    search(tmp_path).run(4, compose, train=training)
    assert len(training.asked) == 2 and len(search(tmp_path).front()) >= 1


def test_an_interrupted_run_is_gone_on_with_first(tmp_path: Path) -> None:
    """A signal leaves the cell interrupted and the trial begun: the next call trains the same config into the same folder."""

    def interrupted(cfg: DictConfig, folder: Path) -> None:
        raise Stopped(signal.SIGTERM)

    with pytest.raises(Stopped):
        search(tmp_path).run(3, compose, train=interrupted)
    assert [cell.state for cell in cells_of(tmp_path)] == ["interrupted"]
    training = Training()
    search(tmp_path).run(3, compose, train=training)
    assert len(training.asked) == 3 and [cell.state for cell in cells_of(tmp_path)] == ["done"] * len(
        {json.dumps(one) for one in training.asked}
    )


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
