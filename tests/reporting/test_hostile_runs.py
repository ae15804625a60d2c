"""Run folders that something broke, or somebody made: a report of them ends in one message that names the file."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from charnerf.cli.commands import run
from charnerf.errors import DataError
from charnerf.reporting import run_files
from charnerf.reporting.blocks import Bullets, Code, Heading, Picture, Table, Text
from charnerf.reporting.document import to_markdown

TABLE = b"method,character,view,psnr\n"
BROKEN = {
    "metrics.json": [b"", b"[]", b"3", b"null", b"\xff\xfe", b"[" * 100_000, b'{"psnr": ' + b"9" * 5000 + b"}", b"{}"],
    "curve.csv": [b"", b"a,b\n1,2,3\n", b"\xff\xfe\x00", b"[]", b"x" * 300_000],
    "views.csv": [b"a,b\n1,2\n", TABLE + b"x,../../y,0,1\n", TABLE + b"x,y,0,nan\n", b"\xff"],
    "config.yaml": [b"[1]", b"3", b"[" * 500, b"a: &a [*a]", b"\xff", b"a: " + b"9" * 5000, b"? {}\n: 1",
                    b"a: !!python/name:os.system"],
    ".hydra/overrides.yaml": [b"{a: 1}", b"3", b"a: ["],
    "start.txt": [b"\xff\xfe"],
    "lods.json": [b"3", b"[1]", b"[" * 100_000, b'{"a": 1}'],
}  # fmt: skip
HARMLESS = {
    "cell.json": [b"", b"[]", b"3", b"[" * 100_000, b'{"state": {"a": [1]}, "error": [1]}', b"\xff"],
    "config.yaml": [
        b"seed: [1]\nname: {a: 1}\n",
        b"combinator: 3\ndata: 3\nscale: [1]\n",
        b"experiment: [x]\n",
    ],
    "curve.csv": [b"seconds\n1e400\nnan\n", b"step,seconds\nx\n1,2,3,4\n", b'seconds,step\n"a\nb",3\n'],
    ".hydra/overrides.yaml": [b"- 3\n- {a: 1}\n- [x]\n", b'- ""\n- "=="\n'],
    "start.txt": [b"<script>alert(1)</script>"],
}


def pairs(files: dict[str, list[bytes]]) -> list[Any]:
    return [
        pytest.param(name, one, id=f"{name}-{index}")
        for name, each in files.items()
        for index, one in enumerate(each)
    ]


@pytest.fixture
def runs(evaluated: Path, tmp_path: Path) -> Path:
    """A folder of two runs."""
    for name in ("a", "b"):
        shutil.copytree(evaluated, tmp_path / "grid" / name)
        (tmp_path / "grid" / name / ".hydra").mkdir()
    return tmp_path / "grid"


@pytest.mark.parametrize(("name", "content"), pairs(BROKEN))
def test_a_broken_file_is_named(
    name: str, content: bytes, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (runs / "b" / name).write_bytes(content)
    assert run(["report", str(runs)]) == 1
    told = capsys.readouterr().err
    assert told.startswith("error: ") and f"b/{name}" in told and "Traceback" not in told
    assert len(told) < 1500


@pytest.mark.parametrize(("name", "content"), pairs(HARMLESS))
def test_what_can_be_shown_is_shown(name: str, content: bytes, runs: Path) -> None:
    (runs / "b" / name).write_bytes(content)
    assert run(["report", str(runs)]) == 0
    assert "<script>alert" not in (runs / "report.md").read_text() + (runs / "report.html").read_text()


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("psnr",), "x"),
        (("psnr",), [1]),
        (("num_views",), {"a": 1}),
        (("num_characters",), 10**400),
        (("split",), 3),
        (("lpips_reason",), {"a": 1}),
        (("by_azimuth",), {}),
        (("by_azimuth", 0), 3),
        (("by_azimuth", 0, "psnr"), "x"),
        (("per_character",), []),
        (("per_character", "ball"), 3),
        (("per_character", "ball"), {}),
        (("per_character", "../../x"), {}),
        (("per_character", "ball", "psnr"), []),
        (("baselines",), 3),
        (("baselines", "white"), [1]),
        (("baselines", "visual_hull", "ahead"), 3),
        (("baselines", "visual_hull", "ahead"), {"psnr_union": 3}),
        (("baselines", "visual_hull", "ahead"), {"silhouette_iou": [3]}),
        (("baselines", "visual_hull", "ahead"), {"silhouette_iou": ["<script>"]}),
        (("baselines", "visual_hull", "ahead"), {"name": []}),
        (("seconds",), 3),
        (("seconds", "train"), "x"),
        (("environment",), "x"),
    ],
)
def test_a_broken_figure_is_named(
    place: tuple, value: object, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = runs / "b" / "metrics.json"
    metrics = json.loads(file.read_text())
    inner = metrics
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    file.write_text(json.dumps(metrics))
    assert run(["report", str(runs)]) == 1
    told = capsys.readouterr().err
    assert f"b/metrics.json: {place[0]}" in told and "Traceback" not in told


def test_markdown_holds_no_html_of_names(tmp_path: Path) -> None:
    evil = "<script>alert(1)</script>"
    blocks = [
        Heading(evil, 1),
        Text(evil),
        Bullets([evil]),
        Table([evil], [[f"{evil}\n# x|y"]]),
        Picture(tmp_path / "x.png", evil),
    ]
    text = to_markdown(blocks, tmp_path)
    assert "<" not in text and "\n# x" not in text
    assert to_markdown([Code("```\n<b>", "")], tmp_path).splitlines()[0] == "````"


def test_tables_fill_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of two bytes have every column in memory."""
    monkeypatch.setattr(run_files, "MOST_CELLS", 100)
    file = tmp_path / "curve.csv"
    file.write_text("step,seconds\n" + "1\n" * 50)
    assert len(run_files.read_curve(file)) == 50
    file.write_text("step,seconds\n" + "1\n" * 51)
    with pytest.raises(DataError, match=r"curve\.csv: found more than 50 rows of 2 columns"):
        run_files.read_curve(file)
