import json
import re
import shutil
import sys

import pytest
import yaml

from charnerf.errors import DataError
from charnerf.evaluation.metrics_file import write_metrics
from charnerf.reporting.folder_report import write_folder_report
from charnerf.reporting.rows import group_rows
from charnerf.reporting.runs import read_runs, read_unfinished

CURVE = (
    "step,phase,seconds,rays,val_psnr,val_psnr_foreground,val_ssim\n0,0,0,0,12,5,0.7\n90,0,{},9,20,14,0.85\n"
)
GRID = (("no_mha", 0, 20.0), ("no_mha", 1, 30.0), ("charnerf", 0, 40.0))


@pytest.fixture(scope="module")
def grid(evaluated, tmp_path_factory):
    """Three finished cells, two of them one row with two seeds; one failed, one killed."""
    folder = tmp_path_factory.mktemp("grids") / "grid"
    found = json.loads((evaluated / "metrics.json").read_text())
    for place, (experiment, seed, seconds) in enumerate(GRID):
        cell = folder / str(place)
        shutil.copytree(evaluated, cell)
        metrics = json.loads(json.dumps(found)) | {"num_parameters": 1234, "steps": 90 + place}
        metrics["psnr_foreground"] += place
        metrics["seconds"]["train"] = seconds
        write_metrics(cell / "metrics.json", metrics)
        (cell / "curve.csv").write_text(CURVE.format(seconds))
        (cell / "config.yaml").write_text(yaml.safe_dump({"name": experiment, "seed": seed, "h": experiment}))
        (cell / ".hydra").mkdir(exist_ok=True)
        overrides = [f"experiment={experiment}", f"seed={seed}", "scale=smoke"]
        (cell / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump(overrides))
    for name, state in (
        ("bad", {"state": "failed", "error": "NumericalError: <nan>"}),
        ("cut", {"state": "running"}),
    ):
        (folder / name).mkdir()
        (folder / name / "cell.json").write_text(json.dumps(state))
    (folder / "cut" / "curve.csv").write_text(CURVE.format(5))
    return folder


def test_seeds_of_one_config_are_one_row(grid):
    rows = group_rows(read_runs(grid))
    assert [(row.label, row.experiment, len(row.runs)) for row in rows] == [
        ("no_mha", "no_mha", 2),
        ("charnerf", "charnerf", 1),
    ]
    both = rows[0]
    assert both.mean("seconds", "train") == 25.0
    assert both.mean("steps") == 90.5
    assert both.spread("psnr_foreground") == pytest.approx(0.5**0.5)  # of figures that differ by 1
    assert rows[1].spread("psnr") is None
    assert both.mean("seconds", "mesh") is None


def test_what_is_not_finished_is_listed_with_its_error(grid):
    found = read_unfinished(grid)
    assert [(one.name, one.state, one.error) for one in found] == [
        ("bad", "failed", "NumericalError: <nan>"),
        ("cut", "interrupted, 90 steps", ""),
    ]


def test_where_nothing_is_finished_what_was_begun_is_named(grid, tmp_path):
    for name in ("bad", "cut"):
        shutil.copytree(grid / name, tmp_path / name)
    with pytest.raises(DataError) as caught:
        write_folder_report(tmp_path)
    assert str(caught.value).splitlines() == [
        f"{tmp_path}: found no metrics.json below it, expected finished runs; the same command goes on with what was begun:",
        "  bad: failed, NumericalError: <nan>",
        "  cut: interrupted, 90 steps",
    ]


def test_report_has_ours_beside_the_papers(grid):
    text = write_folder_report(grid).read_text()
    assert "2 rows, 3 runs" in text
    assert "All runs: scale=smoke." in text
    table = text.split("## Table II")[1].split("## ")[0]
    lines = [line for line in table.splitlines() if line.startswith("|")]
    assert lines[0].count("paper") == 3
    assert lines[2].startswith("| no_mha | 2 |") and "| 29.8 |" in lines[2] and " ± " in lines[2]
    assert lines[3].startswith("| charnerf | 1 |") and "| 34.3 |" in lines[3]
    assert any(line.startswith("| visual hull") for line in lines)
    assert "| no_mha | 1,234 | 25 s | 90 |" in text
    assert "bad: failed: NumericalError: &lt;nan>" in text
    assert "View attention does not clearly earn its place here" in text
    links = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert {"report_curves.png", "report_azimuth.png", "report_distance.png", "report_matrix.png"} == set(
        links
    )
    assert all((grid / link).is_file() for link in links)


def test_html_holds_plots_and_needs_nothing_else(grid):
    write_folder_report(grid)
    page = (grid / "report.html").read_text()
    assert "<title>charnerf: 2 rows, 3 runs in grid</title>" in page
    assert page.count('<figure class="plot">') == 3
    assert "Plotly.react" in page
    assert not re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="(?!data:)', page)
    objects = pytest.importorskip("plotly.graph_objects")
    for text in re.findall(r'<script type="application/json">(.*?)</script>', page):
        objects.Figure(json.loads(text))  # plotly accepts every key and value


def test_without_plotly_the_plots_are_still_pictures_and_the_command_says_so(grid, monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.offline", None)  # as if it were not installed
    text = write_folder_report(grid).read_text()
    page = (grid / "report.html").read_text()
    assert "Plotly" not in page
    assert page.count("<img") == 4
    assert "charnerf[report]" in page and "charnerf[report]" in text


def test_a_run_without_its_data_or_views_is_told(grid, tmp_path):
    run = tmp_path / "old"
    shutil.copytree(grid / "2", run)
    metrics = json.loads((run / "metrics.json").read_text())
    del metrics["data_root"], metrics["num_parameters"], metrics["steps"]
    write_metrics(run / "metrics.json", metrics)
    (run / "views.csv").unlink()
    text = write_folder_report(tmp_path).read_text()
    assert "kept no figures of single views" in text
    assert "does not say where its data set is" in text
    assert "| charnerf | - | 40 s | 90 |" in text  # steps from the curve


def test_levels_of_detail_stand_beside_the_papers(grid):
    meshes = grid / "2" / "meshes"
    meshes.mkdir(exist_ok=True)
    level = {
        "file": "hero_LOD1",
        "grid": 64,
        "faces_asked": None,
        "vertices": 1800,
        "faces": 3600,
        "parts": 1,
    }
    decimated = {**level, "file": "hero_LOD2", "faces_asked": 500}
    both = [{**one, "chamfer_mm": 3.5, "seconds": 0.5} for one in (level, decimated)]
    (meshes / "lods.json").write_text(json.dumps(both))
    text = write_folder_report(grid).read_text()
    assert "| charnerf | hero_LOD1 | 64 | 1800 | 1822 | 3600 | 3640 | 1 | 3.50 | 0.5 s |" in text
    assert "| charnerf | hero_LOD2 | 64 | 1800 | - | 3600 | - |" in text
    (meshes / "lods.json").write_text("{}")
    assert "## Table I\n" not in write_folder_report(grid).read_text()
    (meshes / "lods.json").write_text("[1]")
    with pytest.raises(DataError, match="charnerf mesh --lod"):
        write_folder_report(grid)
    (meshes / "lods.json").unlink()
