import json
import re
import shutil

import pytest

from charnerf.errors import DataError
from charnerf.reporting.folder_report import write_folder_report
from charnerf.reporting.run_files import read_curve
from charnerf.reporting.run_report import write_run_report

CURVE = """step,phase,seconds,rays,val_psnr,val_psnr_foreground,val_ssim,loss/rgb
0,0,0.0,0,12.5,5.0,0.7,nan
100,0,10.5,51200,,,,0.02
200,1,21.0,102400,20.25,14.5,0.85,0.01
"""


@pytest.fixture(scope="module")
def run(evaluated, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "sweep" / "0"
    shutil.copytree(evaluated, folder)
    (folder / "curve.csv").write_text(CURVE)
    (folder / "config.yaml").write_text("seed: 3 # <angle>\n")
    (folder / ".hydra").mkdir()
    (folder / ".hydra" / "overrides.yaml").write_text("- combinator=mean\n- seed=3\n")
    return folder


def test_run_report_holds_the_numbers_and_pictures(run):
    metrics = json.loads((run / "metrics.json").read_text())
    path = write_run_report(run)
    text = path.read_text()
    for value in (f"{metrics['psnr']:.2f}", f"{metrics['baselines']['white']['psnr']:.2f}", "21 s"):
        assert value in text
    assert "lpips" in text and "the character" not in text.split("## What could not be had")[0]
    links = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert {"images/curve.png", "images/angles.png", "images/ball/sheet.png"} <= set(links)
    assert all((run / link).is_file() for link in links)
    assert text.index("| ball |") < text.index("| doll |")  # worst first


def test_characters_of_which_the_hull_is_truer_are_named(run, tmp_path):
    metrics = json.loads((run / "metrics.json").read_text())
    names = [f"figure-{index}" for index in range(10)]
    metrics["baselines"]["visual_hull"]["ahead"] = {"silhouette_iou": names, "psnr_union": []}
    (tmp_path / "metrics.json").write_text(json.dumps(metrics))
    text = write_run_report(tmp_path).read_text()
    assert f"- IoU ↑: 10 of 2 ({', '.join(names[:8])}, and 2 more)\n- union ↑ dB: 0 of 2\n" in text
    del metrics["baselines"]["visual_hull"]["ahead"]  # as it was before there was such a thing
    (tmp_path / "metrics.json").write_text(json.dumps(metrics))
    assert "truer shape" not in write_run_report(tmp_path).read_text()


def test_html_is_one_file_that_needs_nothing_else(run):
    write_run_report(run)
    page = (run / "report.html").read_text()
    sources = re.findall(r'src="([^"]{0,30})', page)
    assert len(sources) >= 4
    assert all(source.startswith("data:image/") for source in sources)
    assert "seed: 3 # &lt;angle&gt;" in page


def test_report_without_a_curve_says_so(run, tmp_path):
    (tmp_path / "metrics.json").write_text((run / "metrics.json").read_text())
    assert "no validation figures over time" in write_run_report(tmp_path).read_text()


def test_curve_keeps_finite_numbers_only(run):
    rows = read_curve(run / "curve.csv")
    assert "loss/rgb" not in rows[0]
    assert rows[2]["val_psnr"] == 20.25
    assert "val_psnr" not in rows[1]


def test_missing_and_broken_files_are_named(tmp_path):
    with pytest.raises(DataError, match=r"metrics\.json: no such file"):
        write_run_report(tmp_path)
    with pytest.raises(DataError, match=r"found no metrics\.json below it"):
        write_folder_report(tmp_path)
    (tmp_path / "metrics.json").write_text("{")
    with pytest.raises(DataError, match="not readable JSON"):
        write_run_report(tmp_path)
    (tmp_path / "metrics.json").write_text("{}")
    with pytest.raises(DataError, match="lacks psnr"):
        write_run_report(tmp_path)
    (tmp_path / "curve.csv").write_text("step,loss\n1,2\n")
    with pytest.raises(DataError, match="expected `seconds`"):
        read_curve(tmp_path / "curve.csv")
