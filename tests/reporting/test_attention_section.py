import json
import math
import shutil

import pytest
import yaml

from charnerf.evaluation.attention import AttentionProfile
from charnerf.evaluation.records import write_record
from charnerf.reporting.folder_report import report

AZIMUTHS = [float(azimuth) for azimuth in range(0, 360, 30)]


def curve(factor):
    cosines = [
        sum(math.cos(math.radians(azimuth - source)) for source in (0, 90, 180)) for azimuth in AZIMUTHS
    ]
    return [factor * one for one in cosines]


@pytest.fixture
def run(evaluated, tmp_path):
    """A run of the paper's model, its profile made already."""
    folder = tmp_path / "paper"
    shutil.copytree(evaluated, folder)
    target = "charnerf.models.combinators.view_attention.ViewAttention"
    (folder / "config.yaml").write_text(
        yaml.safe_dump({"name": "charnerf", "combinator": {"_target_": target}})
    )
    profile = AttentionProfile(
        characters=["doll"],
        sources=["front", "side", "back"],
        azimuth_deg=AZIMUTHS,
        features=[[0.1, 0.2 + 0.001 * azimuth] for azimuth in AZIMUTHS],
        view=[[one, one] for one in curve(0.25)],
        weights=[[[0.5, 0.3, 0.2], [0.6, 0.2, 0.2]] for _ in AZIMUTHS],
        curve=curve(0.25),
        view_factor=0.25,
        num_points=1234,
    )
    write_record(folder / "attention.json", profile)
    return folder


def test_a_runs_report_shows_what_attention_looks_at(run):
    text = report(run).read_text()
    assert text.startswith("# charnerf run paper")
    section = text.split("## What view attention looks at")[1].split("\n## ")[0]
    assert "1,234 points" in section
    assert "= 0.25, not fitted" in section
    assert "front up to 0.55 at 0°" in section
    assert "the view part decides more" in section
    assert (run / "report_attention_0.png").is_file()
    assert "feature part" in (run / "report.html").read_text()


def test_a_grids_report_shows_it_for_the_rows_that_have_it(run):
    other = run.parent / "mean"
    shutil.copytree(run, other)
    (other / "config.yaml").write_text(
        yaml.safe_dump({"name": "no_mha", "combinator": {"_target_": "x.Mean"}})
    )
    text = report(run.parent).read_text()
    assert text.count("## What view attention looks at") == 1
    assert "2 rows, 2 runs" in text


def test_without_weights_or_profile_the_report_says_why(run):
    (run / "attention.json").unlink()
    text = report(run).read_text()
    assert "It can not be drawn" in text and "holds no weights" in text


def test_a_broken_profile_is_named(run):
    (run / "attention.json").write_text(json.dumps({"azimuths": []}))
    assert "expected an attention profile" in report(run).read_text()
