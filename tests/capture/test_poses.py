"""Limbs turn about their joints; what is no limb stays."""

import numpy as np
import pytest

from charnerf.capture.poses import Joints, Pose, find_joints, random_pose, reposed
from charnerf.surfaces.surface_mesh import SurfaceMesh
from support.surfaces import boxes_surface

TRUNK, ARMS, LEGS, HEAD = (0, 12), (12, 36), (36, 60), (60, 72)


@pytest.fixture(scope="module")
def person() -> SurfaceMesh:
    """A T pose of boxes: trunk, two arms, two legs, head; twelve triangles each, finely cut."""
    return boxes_surface(
        [
            ((-0.2, -0.1, 0.9), (0.2, 0.1, 1.5)),
            ((0.2, -0.05, 1.35), (0.8, 0.05, 1.45)),
            ((-0.8, -0.05, 1.35), (-0.2, 0.05, 1.45)),
            ((0.03, -0.08, 0.0), (0.17, 0.08, 0.9)),
            ((-0.17, -0.08, 0.0), (-0.03, 0.08, 0.9)),
            ((-0.12, -0.12, 1.6), (0.12, 0.12, 2.0)),
            ((-0.05, -0.05, 1.5), (0.05, 0.05, 1.6)),
        ]
    )


@pytest.fixture(scope="module")
def joints(person) -> Joints:
    return find_joints(person)


def _corners(surface: SurfaceMesh) -> np.ndarray:
    return surface.triangles.reshape(-1, 3).astype(np.float64)


def test_joints_lie_where_boxes_meet(joints):
    assert joints.shoulder[0] == pytest.approx(0.2, abs=0.05)
    assert joints.shoulder[1] == pytest.approx(1.4, abs=0.05)
    assert joints.neck == pytest.approx(1.55, abs=0.07)
    assert joints.hip[1] == pytest.approx(0.9, abs=0.08)


def test_no_turn_is_no_change(person, joints):
    np.testing.assert_allclose(_corners(reposed(person, joints, Pose())), _corners(person), atol=1e-6)


def test_an_arm_turns_by_its_angle_about_the_shoulder(person, joints):
    turn = np.radians(40.0)
    before, after = _corners(person), _corners(reposed(person, joints, Pose(arms=(turn, 0.0))))
    hand = np.flatnonzero((before[:, 0] > 0.75) & (before[:, 2] > 1.3))
    across, height = joints.shoulder
    for index in hand:
        before_angle = np.arctan2(before[index, 2] - height, before[index, 0] - across)
        after_angle = np.arctan2(after[index, 2] - height, after[index, 0] - across)
        assert before_angle - after_angle == pytest.approx(turn, abs=1e-4)
    others = (before[:, 0] < 0.15) | (before[:, 2] < 0.8)
    np.testing.assert_allclose(after[others], before[others], atol=1e-6)


def test_a_head_turns_and_the_rest_does_not(person, joints):
    before, after = _corners(person), _corners(reposed(person, joints, Pose(head_turn=np.radians(90.0))))
    crown = before[:, 2] > 1.9
    np.testing.assert_allclose(after[crown, 0], -before[crown, 1], atol=1e-6)
    np.testing.assert_allclose(after[crown, 1], before[crown, 0], atol=1e-6)
    body = before[:, 2] < 1.4
    np.testing.assert_allclose(after[body], before[body], atol=1e-6)


def test_a_stride_moves_one_foot_ahead_and_one_back(person, joints):
    after = _corners(reposed(person, joints, Pose(strides=(0.3, -0.3))))
    before = _corners(person)
    feet = before[:, 2] < 0.05
    left, right = feet & (before[:, 0] > 0), feet & (before[:, 0] < 0)
    assert after[left, 1].mean() < -0.15 and after[right, 1].mean() > 0.15


def test_random_poses_stay_within_their_bounds():
    rng = np.random.default_rng(0)
    for _ in range(50):
        pose = random_pose(rng, limbs=0.5, head=0.2)
        assert max(map(abs, pose.arms)) <= 0.5 and max(map(abs, (*pose.legs, *pose.strides))) <= 0.25
        assert abs(pose.head_turn) <= 0.2
    assert random_pose(np.random.default_rng(3), limbs=0.5, head=0.2) == random_pose(
        np.random.default_rng(3), limbs=0.5, head=0.2
    )
