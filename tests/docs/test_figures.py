"""The figures of README and docs: none is stale, none is typed; and the writer itself."""

import csv
import json
import shutil
from pathlib import Path

import pytest

from docs import __main__ as writer
from docs.figures import marks, options, scores, sources
from docs.take import take

ROOT = Path(__file__).resolve().parents[2]
STALE = writer.stale()
KINDS = {"double": lambda text: 2 * text, "lines": lambda: "a\nb"}


@pytest.mark.parametrize("page", [*writer.pages(), ROOT / "docs/speed/bench.md"], ids=lambda page: page.name)
def test_every_figure_is_that_of_its_file(page: Path) -> None:
    assert page not in STALE, "run `python -m docs`"


@pytest.mark.parametrize("page", writer.pages(), ids=lambda page: page.name)
def test_no_figure_is_typed(page: Path) -> None:
    assert not marks.typed(page.read_text(encoding="utf-8")), "put it into a file and a mark around it"


def test_what_stands_between_marks_is_written_and_words_stay() -> None:
    text = "Of <!-- figures: double 'a b' -->old<!-- end --> it.\n<!-- figures: lines --><!-- end -->\nEnd\n"
    new = marks.written(text, KINDS)
    assert new == (
        "Of <!-- figures: double 'a b' -->a ba b<!-- end --> it.\n<!-- figures: lines -->\n\na\nb\n\n<!-- end -->\nEnd\n"
    )
    assert marks.written(new, KINDS) == new
    for wrong in (
        "<!-- figures: double a -->",
        "<!-- figures: unheard --><!-- end -->",
        2 * "<!-- figures: lines -->",
    ):
        with pytest.raises(ValueError, match="expected"):
            marks.written(f"{wrong} text", KINDS)


@pytest.mark.parametrize(
    "text", ["23.9 dB", "80 %", "0.5 s", "7 minutes and 1.2 h", "59 times", "694 MiB", "3 dB"]
)
def test_typed_figures_are_seen(text: str) -> None:
    assert marks.typed(f"It has {text}.")
    assert not marks.typed(
        f"It has <!-- figures: double x -->{text}<!-- end -->, or `{text}`.\n\n    {text}\n"
    )


def test_settings_may_be_typed() -> None:
    assert not marks.typed("2 m tall, 128 px, version 1.3, p < 0.05, 3.11 to 3.13, 6 mm, twelve times")


def test_values_are_looked_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    content = {"parts": [{"name": "one", "share": 0.25}, {"name": "two", "share": 0.5}]}
    (tmp_path / "a.json").write_text(json.dumps(content))
    (tmp_path / "a.csv").write_text("row,PSNR ↑,steps\nours,20.5,7\ntheirs,19,9\n")
    assert sources.value("a.json", "parts/name=two/share", ".0%") == "50 %"
    assert sources.value("a.json", "parts/0/name") == "one"
    assert sources.table("a.csv").splitlines()[2:] == ["| ours | **20.5** | 7 |", "| theirs | 19 | 9 |"]


def test_every_option_says_what_it_is() -> None:
    text = options.options()
    for file in options.CONF.glob("*/*.yaml"):
        assert f"`{file.stem}`" in text
    assert "**`view_free`**" in text and "**`no_mha`**" not in text


def test_tables_of_an_evaluation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(ROOT / "docs/weights/metrics_real_characters.json", tmp_path / "metrics.json")
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    text = scores.scores("metrics.json")
    assert "LPIPS" in text and "white picture" in text
    assert text.count("\n") == 5
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert f"| charnerf | {metrics['psnr']:.2f} |" in text
    assert scores.measured("metrics.json") == "12 characters of the test split, 24 views each"
    assert scores.azimuths("metrics.json").count("330°") == 1
    for one in (metrics, *metrics["baselines"].values()):
        one["lpips"] = None
    (tmp_path / "metrics.json").write_text(json.dumps(metrics))
    assert "LPIPS" not in scores.scores("metrics.json")  # nothing measured it


def test_the_course_of_a_training(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scores, "ROOT", tmp_path)
    (tmp_path / "curve.csv").write_text(
        "step,seconds,val_psnr,val_psnr_foreground\n9,10.5,19,18\n20,42,18,19\n"
    )
    assert scores.course("curve.csv") == (
        "42 s of training, 20 steps; best validation: 19.00 dB, 18.00 dB on the foreground, after 10.5 s"
    )


def test_published_files_name_no_folder_of_a_machine(tmp_path: Path) -> None:
    (tmp_path / "metrics.json").write_text(
        json.dumps({"data_root": "/home/somebody/characters", "all": [{"psnr": 1.5}]})
    )
    take(tmp_path / "taken.json", [tmp_path / "metrics.json"])
    assert json.loads((tmp_path / "taken.json").read_text()) == {
        "data_root": "characters",
        "all": [{"psnr": 1.5}],
    }
    for file in (ROOT / "docs").rglob("*.json"):
        assert '"/' not in file.read_text(encoding="utf-8"), file


def test_runs_that_resumed_the_clock_are_not_added_twice(tmp_path: Path) -> None:
    for name, rows in {"one": "1,10\n2,20\n", "resumed": "3,30\n", "anew": "1,5\n"}.items():
        (tmp_path / f"{name}.csv").write_text(f"step,seconds\n{rows}")
    take(tmp_path / "curve.csv", [tmp_path / f"{name}.csv" for name in ("one", "resumed", "anew")])
    with (tmp_path / "curve.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["seconds"]) for row in rows] == [10.0, 20.0, 30.0, 35.0]
    assert [float(row["step"]) for row in rows] == [1.0, 2.0, 3.0, 4.0]
