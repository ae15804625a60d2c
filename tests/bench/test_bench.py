"""The benchmark's parts: its baseline answers the same field, its numbers are those of known work."""

import json
import math
import time
from dataclasses import replace

import pytest
import torch

from charnerf.bench.baseline import PixelAligned, PixelNeRFLike
from charnerf.bench.headline import Comparison
from charnerf.bench.rendering import measure
from charnerf.bench.subjects import pixels_psnr
from charnerf.bench.sweep import Row, pareto
from charnerf.bench.tables import comparison_table, headline_table, markdown
from charnerf.bench.timing import in_turns
from charnerf.bench.training_step import batch_of, step_timings
from charnerf.bench.workbench import BASELINE
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers
from support.subjects import LIKE, tiny_subject

CPU = torch.device("cpu")


@pytest.mark.parametrize("features", ["image_hull", "image_hull_section", "image_hull_section_consistency"])
@pytest.mark.parametrize("fine", [False, True])
def test_the_baseline_answers_the_same_fields(fine, features):
    one = tiny_subject(fine=fine, features=features)
    points = 0.4 * torch.randn(200, 3) + torch.tensor(helpers.CENTRE)
    dirs = torch.randn(200, 3)
    dirs = dirs / dirs.norm(dim=-1, keepdim=True)
    field = one.network.fine if fine else one.network.coarse
    with torch.no_grad():
        ours, theirs = (
            one.scene.field(points, dirs),
            PixelNeRFLike(one.network).evaluate(field, one.maps, points, dirs),
        )
    torch.testing.assert_close(ours.rgb, theirs.rgb, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(ours.densities, theirs.densities, atol=1e-4, rtol=1e-4)


def test_all_methods_converge_to_the_reference():
    one = tiny_subject()
    truth = one.converged
    assert truth.dtype == torch.float64 and (truth < 0.99).any()
    with torch.no_grad():
        baseline = PixelNeRFLike(one.network, num_coarse=1024, num_fine=512).render(one.maps, one.rays)
    assert (baseline.rgb - truth).abs().max() < 0.02
    renderers = {
        "culled": CulledRenderer(**{**LIKE, "num_coarse": 256}),
        "adaptive": AdaptiveRenderer(**LIKE, tolerance=0.05),
    }
    found = measure(one, renderers, repeats=1)
    assert found["culled"].max_error < 0.005
    assert found["adaptive"].max_error <= 0.05
    assert found[BASELINE].left_out is None and found["adaptive"].estimate is not None
    compared = Comparison(one, found).as_dict()
    assert compared["methods"]["adaptive"]["tolerance"]["true"] == found["adaptive"].max_error
    assert compared["speedup"]["culled"] == found[BASELINE].seconds / found["culled"].seconds
    json.dumps(compared)
    assert "adaptive" in comparison_table([compared])


def test_seconds_are_those_of_the_work():
    calls: list[str] = []

    def slow() -> str:
        calls.append("slow")
        time.sleep(0.02)
        return "done"

    found = in_turns({"slow": slow, "fast": lambda: calls.append("fast")}, repeats=3, device=CPU)
    assert found["slow"].median >= 0.02 and found["slow"].answer == "done"
    assert found["slow"].low <= found["slow"].median <= found["slow"].high
    assert calls == ["slow", "fast"] * 4


def test_the_front_holds_what_nothing_beats():
    def row(seconds: float, error: float) -> Row:
        return Row("a", "b", seconds, 1.0, error, error, 20.0)

    rows = [row(1, 0.5), row(2, 0.6), row(3, 0.1), row(2.5, 0.1), row(4, 0.2)]
    assert [one.seconds for one in pareto(rows)] == [1, 2.5]


def test_training_steps_lower_their_loss():
    one = tiny_subject()
    batch = batch_of(one, 64)
    assert batch.rgb.shape == (64, 3)
    timings = step_timings(
        one,
        batch,
        {"culled": CulledRenderer(**{**LIKE, "num_coarse": 8})},
        repeats=1,
    )
    assert timings.keys() == {"culled", BASELINE}
    assert all(math.isfinite(timing.answer) for timing in timings.values())


def test_tables():
    table = markdown(("a", "long name"), [(1, 0.12345), (True, None)])
    assert table.splitlines()[2].split("|")[2].strip() == "0.123"
    assert "yes" in table and "-" in table
    assert "0.5" in headline_table({"x": 0.5, "how": {}})


def test_psnr_of_known_errors():
    truth = torch.zeros(10, 3)
    assert pixels_psnr(truth + 0.1, truth) == pytest.approx(20.0, abs=1e-4)


def test_settings_and_maps():
    assert CulledRenderer(**LIKE).settings == LIKE
    one = tiny_subject()
    again = PixelAligned.of(one.network.encode(one.views))
    torch.testing.assert_close(again.feature_maps, one.maps.feature_maps)
    assert replace(one, name="x").name == "x"
