"""The laboratory's measures: their numbers are those of known work."""

import math
import time
from dataclasses import replace

import pytest
import torch
from torch.utils.flop_counter import FlopCounterMode

from benchmarks.grids import CUBE_SIDE, grid_share, hausdorff
from benchmarks.hull_cut import cut_by_hull
from benchmarks.kinds import KINDS
from benchmarks.processes import Course
from benchmarks.roofline import IN_PLACE, roofline
from benchmarks.scaling import exponent, grow
from benchmarks.tricks import tricks
from benchmarks.untrained import untrained_like
from charnerf.bench.turntable import turned
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models
from support.subjects import LIKE, pictured_person, tiny_subject

CPU = torch.device("cpu")


def test_tricks_change_seconds_and_no_colors():
    one = tiny_subject()
    bench = type("Bench", (), {"like": LIKE, "renderers": {"culled": CulledRenderer(**LIKE)}})()
    with torch.no_grad():
        answers = {name: build(one)().finest.rgb for (_, name), build in tricks(bench).items()}
    for name, rgb in answers.items():
        limit = 0.1 if name == "hull segments off" else 1e-4
        assert (rgb - answers["all on"]).abs().max() < limit, name


def test_exponents():
    assert exponent([8, 16, 32], [3.0 * n**1.5 for n in (8, 16, 32)]) == pytest.approx(1.5)
    found = grow("naps", {n: lambda n=n: time.sleep(0.01 * n) for n in (1, 2, 4, 8)}, CPU)
    assert found.seconds_exponent == pytest.approx(1.0, abs=0.35)
    assert len(found.memory_mib) == 4


def test_a_sparse_grid_gives_the_mesh_of_all_points():
    found = grid_share(tiny_subject(), cells=64, num_cameras=8)
    assert found.distance < 0.1 * CUBE_SIDE / 64
    assert 0.0 < found.share <= found.all_share < 0.2


def test_seconds_to_an_error_are_those_of_the_first_that_reaches_it():
    course = Course(seconds=(1.0, 2.0, 3.0, 4.0), decibels=(9.0, 12.0, 11.0, 13.0), steps=8)
    assert course.seconds_to(11.0) == 2.0 and course.seconds_to(12.5) == 4.0
    assert course.seconds_to(14.0) == math.inf


def test_distance_of_meshes():
    import trimesh

    box = trimesh.creation.box((1, 1, 1))
    moved = box.copy().apply_translation((0.3, 0, 0))
    assert hausdorff(box, box) == 0.0
    assert hausdorff(box, moved) == pytest.approx(0.3)


def test_arithmetic_is_counted():
    one = tiny_subject()
    found = roofline(one, CulledRenderer(**LIKE), rounds=1, side=256)
    points = 48 * 16
    assert 0 < found.gflop * 1e9 < points * 4e6
    assert found.share == pytest.approx(found.achieved_gflops / found.peak_gflops)


def test_products_that_add_in_place_count():
    a, b, total = torch.ones(10, 20), torch.ones(20, 30), torch.ones(10, 30)
    with FlopCounterMode(display=False, custom_mapping=IN_PLACE) as counter:
        total.addmm_(a, b)
        torch.addmm(total, a, b)
    assert counter.get_total_flops() == 2 * 2 * 10 * 20 * 30


def test_untrained_networks_are_seeded_and_empty_of_training():
    network = tiny_subject().network
    first, again, other = (untrained_like(network, seed) for seed in (0, 0, 1))
    for a, b in zip(first.parameters(), again.parameters(), strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=0)
    assert any(not torch.equal(a, b) for a, b in zip(first.parameters(), other.parameters(), strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_stand_in_the_world_frame(kind):
    low, high = KINDS[kind]().bounds
    assert high[2] == pytest.approx(2.0, abs=0.02) and low[2] == pytest.approx(0.0, abs=1e-6)


def test_the_hull_cuts_nothing_of_what_it_was_carved_from():
    model = tiny_models.tiny_model(features="image_hull").eval()
    person = pictured_person()
    camera, picture = person.camera, person.picture
    (row,) = cut_by_hull(model, [person])
    assert row["pixels shown"] == int((picture[..., 3] > 0.5).sum()) > 20
    assert row["cut"] == 0
    moved = replace(camera, world_from_camera=camera.world_from_camera.clone())
    moved.world_from_camera[2, 3] += 2.0  # the picture does not belong to this camera
    (wrong,) = cut_by_hull(model, [replace(person, camera=moved)])
    assert wrong["cut"] > 0


def test_a_turntable_s_camera_goes_round():
    camera = helpers.target_cameras(4, size=24)[1]
    quarter = turned(camera, 0.5 * math.pi)
    centre = camera.world_from_camera[:3, 3]
    assert torch.allclose(quarter.world_from_camera[2, 3], centre[2])
    assert torch.allclose(quarter.world_from_camera[:2, 3].norm(), centre[:2].norm())
    assert abs(float(quarter.world_from_camera[:2, 3] @ centre[:2])) < 1e-4
    assert torch.allclose(
        turned(quarter, 1.5 * math.pi).world_from_camera, camera.world_from_camera, atol=1e-5
    )
