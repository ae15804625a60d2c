"""Closed shapes: volumes, orientation, textures the right way round."""

import numpy as np
import pytest
import trimesh

from charnerf.procedural.shapes import ball, box, lathe, loft, sheet, slab, tube


def mesh_of(shape):
    return trimesh.Trimesh(shape.vertices, shape.faces, process=False)


def grid():
    x, z = np.meshgrid(np.linspace(0.0, 2.0, 5), np.linspace(0.0, 1.0, 4))
    return np.stack((x, np.zeros_like(x), z), axis=-1)


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (box((0.3, 0.1, 2.0), (1.0, 2.0, 3.0)), 48.0),
        (sheet(grid(), 0.1), 0.2),
        (slab(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)), 0.5), 1.0),
        (lathe((0.0, 0.0, 0.0), ((1.0, 0.0), (1.0, 2.0)), sides=4), 8.0),
        (box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)).mirrored(), 8.0),
    ],
)
def test_volumes(shape, volume):
    mesh = mesh_of(shape)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume, rel=1e-9)


def test_ball_tends_to_a_sphere_and_to_a_box():
    assert mesh_of(ball((0.0, 0.0, 0.0), 1.0, sides=64, rings=48)).volume == pytest.approx(
        4.0 / 3.0 * np.pi, rel=0.01
    )
    assert mesh_of(ball((0.0, 0.0, 0.0), 1.0, sides=64, rings=48, power=40.0)).volume > 7.0


@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.2, 1.0), (0.3, 0.5, -1.0)])
def test_tubes_in_any_direction_are_closed_and_outwards(direction):
    path = np.outer((0.0, 0.4, 1.0), direction)
    mesh = mesh_of(tube(path, np.array((0.1, 0.2, 0.05))))
    assert mesh.is_watertight
    assert mesh.volume > 0.0


def test_u_half_is_the_front_and_grows_towards_the_left_hand():
    shape = loft(((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (0.5, 0.5), sides=16)
    corners, u = shape.vertices[shape.faces].reshape(-1, 3), shape.uv.reshape(-1, 2)[:, 0]
    front = corners[np.isclose(u, 0.5) & (np.hypot(corners[:, 0], corners[:, 1]) > 0.4)]
    left = corners[np.isclose(u, 0.75) & (np.hypot(corners[:, 0], corners[:, 1]) > 0.4)]
    np.testing.assert_allclose(front[:, :2], np.broadcast_to((0.0, -0.5), front[:, :2].shape), atol=1e-12)
    np.testing.assert_allclose(left[:, :2], np.broadcast_to((0.5, 0.0), left[:, :2].shape), atol=1e-12)
