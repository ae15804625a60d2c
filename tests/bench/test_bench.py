"""The benchmark's parts: its baseline answers the same field, its numbers are those of known work."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import replace

import pytest
import torch
from torch.utils.flop_counter import FlopCounterMode

from charnerf.bench.baseline import PixelAligned, PixelNeRFLike
from charnerf.bench.everything import turned
from charnerf.bench.grids import grid_share, hausdorff
from charnerf.bench.headline import Comparison
from charnerf.bench.hull_cut import cut_by_hull
from charnerf.bench.kinds import KINDS
from charnerf.bench.measure import in_turns
from charnerf.bench.rendering import BASELINE, measure
from charnerf.bench.roofline import IN_PLACE, roofline
from charnerf.bench.scaling import exponent, grow
from charnerf.bench.subjects import Pictured, Subject, pixels_psnr, reference, subject, untrained_like
from charnerf.bench.sweeps import Row, pareto
from charnerf.bench.tables import comparison_table, headline_table, markdown
from charnerf.bench.training_step import batch_of, step_timings
from charnerf.bench.tricks import variants
from charnerf.bench.workbench import settings_of
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

CPU = torch.device("cpu")
LIKE = {
    "quadrature": PiecewiseConstant(),
    "num_coarse": 16,
    "num_fine": 8,
    "hull_steps": 128,
    "memory_mib": 64,
}


@pytest.fixture(scope="module")
def tiny(person_views) -> Callable[..., Subject]:
    """A shaken model of a person, 48 pixels of a picture."""

    def make(*, fine: bool = False, features: str = "image_hull") -> Subject:
        torch.manual_seed(1)
        model = tiny_models.tiny_model(fine=fine, features=features)
        network = tiny_models.shake(model, scale=0.15).requires_grad_(False).eval()
        camera = helpers.target_cameras(4, size=24)[1]
        picture = helpers.photograph(helpers.person(symmetric=False), helpers.target_cameras(4, size=24)[1:2])
        pictured = Pictured("person", person_views, camera, picture[0])
        return subject(pictured, network, kind="test", num_pixels=48)

    return make


@pytest.mark.parametrize("features", ["image_hull", "image_hull_section", "image_hull_section_consistency"])
@pytest.mark.parametrize("fine", [False, True])
def test_the_baseline_answers_the_same_fields(fine, features, tiny):
    one = tiny(fine=fine, features=features)
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


def test_all_methods_converge_to_the_reference(tiny):
    one = tiny()
    truth = reference(one)
    assert truth.dtype == torch.float64 and (truth < 0.99).any()
    with torch.no_grad():
        baseline = PixelNeRFLike(one.network, num_coarse=1024, num_fine=512).render(one.maps, one.rays)
    assert (baseline.rgb - truth).abs().max() < 0.02
    renderers = {
        "culled": CulledRenderer(**{**LIKE, "num_coarse": 256}),
        "adaptive": AdaptiveRenderer(**LIKE, tolerance=0.05),
    }
    found = measure(one, renderers, truth, repeats=1)
    assert found["culled"].max_error < 0.005
    assert found["adaptive"].max_error <= 0.05
    assert found[BASELINE].left_out is None and found["adaptive"].estimate is not None
    compared = Comparison(one, found).as_dict()
    assert compared["methods"]["adaptive"]["tolerance"]["true"] == found["adaptive"].max_error
    assert compared["speedup"]["culled"] == found[BASELINE].seconds / found["culled"].seconds
    json.dumps(compared)
    assert "adaptive" in comparison_table([compared])


def test_tricks_change_seconds_and_no_colours(tiny):
    one = tiny()
    bench = type("Bench", (), {"like": LIKE, "renderers": {"culled": CulledRenderer(**LIKE)}})()
    with torch.no_grad():
        answers = {name: build(one)().finest.rgb for name, build in variants(bench).items()}
    for name, rgb in answers.items():
        limit = 0.1 if name == "hull segments off" else 1e-4
        assert (rgb - answers["all on"]).abs().max() < limit, name


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


def test_exponents():
    assert exponent([8, 16, 32], [3.0 * n**1.5 for n in (8, 16, 32)]) == pytest.approx(1.5)
    found = grow("naps", {n: lambda n=n: time.sleep(0.01 * n) for n in (1, 2, 4, 8)}, CPU)
    assert found.seconds_exponent == pytest.approx(1.0, abs=0.35)
    assert len(found.memory_mib) == 4


def test_a_sparse_grid_gives_the_mesh_of_all_points(tiny):
    found = grid_share(tiny(), cells=64, num_cameras=8)
    assert found.same and found.distance < 1e-4
    assert 0.0 < found.share <= found.all_share < 0.2


def test_distance_of_meshes():
    import trimesh

    box = trimesh.creation.box((1, 1, 1))
    moved = box.copy().apply_translation((0.3, 0, 0))
    assert hausdorff(box, box) == 0.0
    assert hausdorff(box, moved) == pytest.approx(0.3)


def test_arithmetic_is_counted(tiny):
    one = tiny()
    found = roofline(one, CulledRenderer(**LIKE), rounds=1, side=256)
    points = 48 * 16
    assert 0 < found.gflop * 1e9 < points * 4e6
    assert found.share == pytest.approx(found.achieved_gflops / found.peak_gflops)


def test_products_that_add_in_place_count(tiny):
    a, b, total = torch.ones(10, 20), torch.ones(20, 30), torch.ones(10, 30)
    with FlopCounterMode(display=False, custom_mapping=IN_PLACE) as counter:
        total.addmm_(a, b)
        torch.addmm(total, a, b)
    assert counter.get_total_flops() == 2 * 2 * 10 * 20 * 30


def test_training_steps_lower_their_loss(tiny):
    one = tiny()
    batch = batch_of(one, 64)
    assert batch.rgb.shape == (64, 3)
    timings = step_timings(
        one,
        batch,
        {"culled": CulledRenderer(**{**LIKE, "num_coarse": 8})},
        repeats=1,
        baseline=BASELINE,
    )
    assert timings.keys() == {"culled", BASELINE}
    assert all(math.isfinite(timing.answer) for timing in timings.values())


def test_untrained_networks_are_seeded_and_empty_of_training(tiny):
    network = tiny().network
    first, again, other = (untrained_like(network, seed) for seed in (0, 0, 1))
    for a, b in zip(first.parameters(), again.parameters(), strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=0)
    assert any(not torch.equal(a, b) for a, b in zip(first.parameters(), other.parameters(), strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_stand_in_the_world_frame(kind):
    low, high = KINDS[kind]().bounds
    assert high[2] == pytest.approx(2.0, abs=0.02) and low[2] == pytest.approx(0.0, abs=1e-6)


def test_tables():
    table = markdown(("a", "long name"), [(1, 0.12345), (True, None)])
    assert table.splitlines()[2].split("|")[2].strip() == "0.123"
    assert "yes" in table and "-" in table
    assert "worst kind, slowest" in headline_table({"x": 1.0, "how": {}, "worst_kind": {"slowest": "fog"}})


def test_psnr_of_known_errors():
    truth = torch.zeros(10, 3)
    assert pixels_psnr(truth + 0.1, truth) == pytest.approx(20.0, abs=1e-4)


def test_settings_and_maps(tiny):
    assert settings_of(CulledRenderer(**LIKE)) == LIKE
    one = tiny()
    again = PixelAligned.of(one.network.encode(one.views))
    torch.testing.assert_close(again.feature_maps, one.maps.feature_maps)
    assert replace(one, name="x").name == "x"


def test_the_hull_cuts_nothing_of_what_it_was_carved_from(person_views):
    model = tiny_models.tiny_model(features="image_hull").eval()
    camera = helpers.target_cameras(4, size=24)[1]
    picture = helpers.photograph(helpers.person(symmetric=False), helpers.target_cameras(4, size=24)[1:2])[0]
    (row,) = cut_by_hull(model, [Pictured("person", person_views, camera, picture)])
    assert row["pixels shown"] == int((picture[..., 3] > 0.5).sum()) > 20
    assert row["cut"] == 0
    moved = replace(camera, world_from_camera=camera.world_from_camera.clone())
    moved.world_from_camera[2, 3] += 2.0  # the picture does not belong to this camera
    (wrong,) = cut_by_hull(model, [Pictured("person", person_views, moved, picture)])
    assert wrong["cut"] > 0


def test_a_turntable_s_camera_goes_round(person_views):
    camera = helpers.target_cameras(4, size=24)[1]
    quarter = turned(camera, 0.5 * math.pi)
    centre = camera.world_from_camera[:3, 3]
    assert torch.allclose(quarter.world_from_camera[2, 3], centre[2])
    assert torch.allclose(quarter.world_from_camera[:2, 3].norm(), centre[:2].norm())
    assert abs(float(quarter.world_from_camera[:2, 3] @ centre[:2])) < 1e-4
    assert torch.allclose(
        turned(quarter, 1.5 * math.pi).world_from_camera, camera.world_from_camera, atol=1e-5
    )
