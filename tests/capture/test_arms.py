from dataclasses import replace

import numpy as np
import pytest
import trimesh

from charnerf.capture.arms import find_arms, lower_arms
from charnerf.capture.outline import middle_runs
from charnerf.errors import DataError
from charnerf.surfaces.scene_mesh import surface_of_scene

TRUNK, SHOULDER, REACH = 0.3, 1.4, 1.2  # half width, height of the arms, m


def box(size, middle):
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(middle)
    for _ in range(4):
        mesh = mesh.subdivide()
    return mesh


def t_pose(*, arms=True):
    """Trunk with legs as one block, head, and arms held out; the arms are the last triangles."""
    parts = [box((2 * TRUNK, 0.3, 1.6), (0.0, 0.0, 0.8)), box((0.3, 0.3, 0.4), (0.0, 0.0, 1.8))]
    if arms:
        parts += [box((2 * REACH, 0.15, 0.15), (0.0, 0.0, SHOULDER))]
    return surface_of_scene(trimesh.util.concatenate(parts)), len(parts[-1].faces)


def test_level_arms_are_found():
    surface, _ = t_pose()
    found = find_arms(surface, middle_runs(surface))
    assert found.shoulder == pytest.approx(TRUNK, abs=0.05)
    assert found.reach == pytest.approx(REACH, abs=1e-6)
    assert (found.low, found.high) == pytest.approx((SHOULDER - 0.075, SHOULDER + 0.075), abs=1e-6)


def test_who_holds_no_arms_out_stays():
    surface, _ = t_pose(arms=False)
    assert find_arms(surface, middle_runs(surface)) is None
    np.testing.assert_array_equal(lower_arms(surface, np.random.default_rng(0)), surface.triangles)


def test_a_surface_without_area_is_refused():
    """One bad mesh of many is a message, not the end of a capture."""
    surface, _ = t_pose()
    line = replace(surface, triangles=surface.triangles * np.array((0.0, 0.0, 1.0), np.float32))
    with pytest.raises(DataError, match="area of 0"):
        lower_arms(line, np.random.default_rng(0))


@pytest.mark.parametrize("seed", range(12))
def test_arms_turn_about_the_shoulders(seed):
    """Upper arms go down, both sides alike, no arm is longer or shorter by much; the rest stays; nothing tears."""
    surface, of_arms = t_pose()
    lowered = lower_arms(surface, np.random.default_rng(seed))
    before = surface.triangles.astype(np.float64)
    moved = np.abs(lowered - before)
    near = (np.abs(before[..., 0]) > TRUNK - 0.081) & (np.abs(before[..., 2] - SHOULDER) < 0.156)
    assert moved[:-of_arms][~near[:-of_arms]].max() < 1e-6
    assert moved[:-of_arms].max() < 0.15  # the shoulders themselves give way
    hands = np.abs(before[..., 0]) > REACH - 1e-6
    upper_arms = np.abs(np.abs(before[..., 0]) - 0.55) < 0.06
    assert lowered[upper_arms][:, 2].mean() < SHOULDER - 0.03
    for side in (-1.0, 1.0):
        hand = lowered[hands & (before[..., 0] * side > 0)].mean(0)
        shoulder = np.array((side * TRUNK, 0.0, SHOULDER))
        assert np.linalg.norm(hand - shoulder) <= (REACH - TRUNK) * 1.01
        assert np.linalg.norm(hand - shoulder) >= (REACH - TRUNK) * 0.6  # elbows bend, by 100 degrees at most
        assert hand[1] < 0.02  # forward, if anywhere
    left, right = (
        np.unique(lowered[hands & (before[..., 0] * side > 0)][:, 2].round(5)) for side in (-1.0, 1.0)
    )
    np.testing.assert_allclose(left, right, atol=2e-5)
    arms = trimesh.Trimesh(**trimesh.triangles.to_kwargs(lowered[-of_arms:]))
    arms.merge_vertices(digits_vertex=5)
    assert arms.is_watertight
    assert 0.7 < arms.volume / (2 * REACH * 0.15**2) < 1.3


def test_forearms_point_forward_at_times():
    """Hands come as far forward as forearms are long, in some of the poses, and stay beside the body in others."""
    surface, _ = t_pose()
    hands = np.abs(surface.triangles[..., 0]) > REACH - 1e-6
    forward = [-lower_arms(surface, np.random.default_rng(seed))[hands][:, 1].mean() for seed in range(40)]
    forearm = 0.55 * (REACH - TRUNK)
    assert max(forward) > 0.8 * forearm
    assert np.mean(np.array(forward) < 0.4 * forearm) > 0.4


def test_draws_do_not_depend_on_the_character():
    """What follows the arms in a variant is the same with arms and without."""
    after = []
    for surface, _ in (t_pose(), t_pose(arms=False)):
        rng = np.random.default_rng(3)
        lower_arms(surface, rng)
        after.append(rng.random())
    assert after[0] == after[1]
