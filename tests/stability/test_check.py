"""The check: its catalogue holds here, its naive formulas fail, and it can say no."""

import json
import math
from dataclasses import replace

import pytest
import torch

from charnerf.config.composition import compose_config
from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.inference.build import build_model, build_renderer
from charnerf.stability import CheckReport, TrainedField, light, naive, run_check
from charnerf.stability.measure import Target
from charnerf.stability.report import CheckRow
from charnerf.stability.trained import check_trained
from charnerf.types import SourceViews

CPU = torch.device("cpu")
ROW = CheckRow("alphas", "a case", "cpu", "float32", "ours", 1e-7, 1e-7, 0, 1e-6, 1e-6)


@pytest.fixture(scope="module")
def report() -> CheckReport:
    return run_check(devices=[CPU])


def test_every_bound_holds(report):
    assert report.passed, report.table()


def test_everything_of_ours_is_finite_and_every_naive_formula_fails(report):
    ours = [row for row in report.rows if row.formula == "ours"]
    others = [row for row in report.rows if row.formula == "naive"]
    assert all(row.non_finite == 0 for row in ours)
    assert others and all(row.verdict == "fails" for row in others)


def test_light_sums_to_one_in_every_case(report):
    bounds = {"float32": 5e-6, "float64": 1e-13, "bfloat16": 5e-6, "float16": 5e-6}
    partitions = [row for row in report.rows if row.kernel == "weights + transmittance = 1"]
    media = {
        "homogeneous slab",
        "step wall",
        "two walls",
        "exponential density",
        "linear density",
        "thin shell",
    }
    assert media <= {row.case for row in partitions}
    assert all(row.value_error <= bounds[row.dtype] for row in partitions)


def test_the_catalogue_covers_every_kernel(report):
    found = {row.kernel for row in report.rows}
    expected = {
        "alphas", "weights", "weights, closed form", "composite", "expected_depth", "importance sampling",
        "importance sampling, linear", "quadrature order", "normalise", "positional encoding", "ray and box",
        "occupied length", "pixel -> point -> pixel", "projection", "combinator view_mha", "combinator mean",
        "density activation", "surface alpha", "loss", "moved projection", "moved rays", "moved hull",
        "moved compositing",
    }  # fmt: skip
    assert expected <= found


def test_report_is_written(report, tmp_path):
    report.to_json(tmp_path / "check.json")
    content = json.loads((tmp_path / "check.json").read_text())
    assert content["passed"] and len(content["rows"]) == len(report.rows)
    assert {curve["panel"] for curve in content["curves"]} >= {"alpha against stiffness sigma * delta"}
    report.plot(tmp_path / "check.png")
    assert (tmp_path / "check.png").read_bytes().startswith(b"\x89PNG")
    table = report.table()
    assert len(table.splitlines()) == len(report.rows) + 3 and "0 broken" in table


def test_a_row_knows_its_verdict():
    assert ROW.verdict == "holds"
    assert replace(ROW, value_error=1e-5).verdict == "BROKEN"
    assert replace(ROW, gradient_error=math.inf).verdict == "BROKEN"
    assert replace(ROW, non_finite=1).verdict == "BROKEN"
    assert replace(ROW, value_error=math.nan).verdict == "BROKEN"
    assert replace(ROW, value_bound=None, value_error=9.0).verdict == "holds"
    assert replace(ROW, formula="naive").verdict == "NOT SHOWN"
    assert replace(ROW, formula="naive", value_error=1.0).verdict == "fails"


def test_the_check_can_fail(monkeypatch):
    """With the usual formula in the place of ours, the catalogue says so."""
    monkeypatch.setattr(light, "weights_from_densities", naive.weights)
    rows = [r for r in light.medium_cases(Target(CPU, torch.float32)) if isinstance(r, CheckRow)]
    report = CheckReport(rows=tuple(rows), curves=(), seconds=0.0, environment={})
    assert not report.passed and "BROKEN" in report.table()


@pytest.fixture(scope="module")
def trained() -> TrainedField:
    """An untrained field of the smallest scale, with drawings of an ellipsoid."""
    torch.manual_seed(0)
    cfg = compose_config(["scale=smoke"])
    angles, centre = torch.tensor([0.0, 90.0, 180.0]), torch.tensor([0.0, 0.0, 1.0])
    framing = {"target": centre, "distance": 4.0, "half_extent": 1.2, "size": 32}
    sources = cameras_towards(direction_from_angles(angles, torch.zeros(3)), orthographic=True, **framing)
    y, x = torch.meshgrid(torch.arange(32) + 0.5, torch.arange(32) + 0.5, indexing="ij")
    pictures = torch.rand(1, 3, 4, 32, 32)
    pictures[:, :, 3] = (((x - 16) / 6).square() + ((y - 16) / 12).square() < 1).float()
    flags = torch.ones(1, 3, dtype=torch.bool)
    views = SourceViews(images=pictures, cameras=sources[None], present=flags, mirrored=~flags)
    aim = direction_from_angles(torch.tensor(30.0), torch.tensor(20.0))
    camera = cameras_towards(aim, orthographic=False, **framing)
    network = build_model(cfg).eval().requires_grad_(False)
    return TrainedField(network=network, renderer=build_renderer(cfg), views=views, camera=camera)


def test_a_sound_field_passes(trained):
    rows = list(check_trained(trained))
    assert all(row.ok for row in rows), [row for row in rows if not row.ok]
    cases = " ".join(row.case for row in rows)
    for part in (
        "sigma * delta",
        "saturated",
        "transmittance",
        "float64",
        "reversed",
        "twice",
        "moved",
        "turn",
    ):
        assert part in cases


def test_a_field_of_nan_is_found(trained):
    weight = trained.network.coarse.multi_view.density.weight
    before = weight.clone()
    weight.fill_(torch.nan)
    try:
        assert any(row.non_finite and not row.ok for row in check_trained(trained))
    finally:
        weight.copy_(before)
