import numpy as np
import pytest
import torch
import trimesh
from scipy import stats

from charnerf.data.surface import AreaSurface, VisibleSurface, visible_surface_points
from charnerf.errors import DataError
from charnerf.surfaces.mesh_files import write_surface_mesh
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import interpolate, triangle_areas
from support.surfaces import plain_mesh, textured_quad


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def two_parts():
    """An open square of 3 m^2 at z = 0 and one of 1 m^2 at z = 1, with a triangle without area between."""
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    large = square * (3.0, 1.0, 1.0)
    flat = np.array([[[0, 0, 0.5], [1, 0, 0.5], [2, 0, 0.5]]])
    return plain_mesh(np.concatenate((large, flat, square + np.array([0.0, 0.0, 1.0]))))


def test_counts_follow_area():
    count = 20_000
    points = AreaSurface(two_parts()).sample(count, generator()).points[0]
    low, high = stats.binom.interval(1.0 - 1e-6, count, 0.25)
    assert low <= int((points[:, 2] > 0.75).sum()) <= high
    assert not bool(((points[:, 2] > 0.25) & (points[:, 2] < 0.75)).any())


def test_points_are_even_inside_a_triangle():
    """Halving a triangle through a corner halves its points, for every corner."""
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    points = AreaSurface(plain_mesh(corners[None])).sample(20_000, generator()).points[0].double().numpy()
    weights = np.linalg.lstsq(
        np.vstack((corners.T, np.ones(3))), np.vstack((points.T, np.ones(len(points)))), rcond=None
    )[0]
    assert weights.min() > -1e-6
    low, high = stats.binom.interval(1.0 - 1e-6, len(points), 0.5)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        assert low <= (weights[first] > weights[second]).sum() <= high


def test_points_lie_on_their_triangles():
    sphere = surface_of_scene(trimesh.creation.icosphere(subdivisions=2))
    area = AreaSurface(sphere)
    draw = area.draw(1000, generator())
    corners = sphere.triangles[draw.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    points = interpolate(corners, draw.u, draw.v)
    assert np.abs(((points - corners[:, 0]) * normals).sum(-1)).max() < 1e-9
    assert draw.u.min() >= 0 and draw.v.min() >= 0 and (draw.u + draw.v).max() <= 1 + 1e-12


@pytest.mark.parametrize("kind", [AreaSurface, VisibleSurface])
def test_one_seed_gives_the_same_points(kind):
    mesh = surface_of_scene(trimesh.creation.icosphere(subdivisions=1))
    first, again = (kind(mesh).sample(100, generator(3)) for _ in range(2))
    other = kind(mesh).sample(100, generator(4))
    assert torch.equal(first.points, again.points) and torch.equal(first.rgb, again.rgb)
    assert not torch.equal(first.points, other.points)
    assert first.points.shape == first.rgb.shape == (1, 100, 3)
    assert first.points.dtype == first.rgb.dtype == torch.float32


def test_linear_half_becomes_188():
    sample = AreaSurface(plain_mesh(two_parts().triangles, (0.5, 0.5, 0.0, 1.0))).sample(10, generator())
    np.testing.assert_array_equal(np.rint(255 * sample.rgb[0, 0].numpy()), (188, 188, 0))


def test_no_area_is_refused():
    with pytest.raises(DataError, match=r"area of 0 m\^2"):
        AreaSurface(plain_mesh(np.zeros((2, 3, 3))))


def test_a_surface_cut_out_whole_is_refused():
    mesh = plain_mesh(two_parts().triangles, (1.0, 1.0, 1.0, 0.0), cutoff=0.5)
    with pytest.raises(DataError, match="alpha cuts out"):
        AreaSurface(mesh).sample(10, generator())


def nested_balls():
    """A ball in a ball: the inner one is never seen."""
    inner = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    outer = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    return surface_of_scene(trimesh.Scene([inner, outer]).apply_translation((0.0, 0.0, 1.0)))


def test_visible_points_leave_inner_faces_out():
    centre = torch.tensor((0.0, 0.0, 1.0))
    by_area = (AreaSurface(nested_balls()).sample(4000, generator()).points[0] - centre).norm(dim=-1)
    seen = (VisibleSurface(nested_balls()).sample(4000, generator()).points[0] - centre).norm(dim=-1)
    assert 0.15 < float((by_area < 0.75).float().mean()) < 0.25
    assert float(seen.min()) > 0.95


def test_a_surface_says_what_it_keeps():
    """The visible one keeps its pool alone, not the mesh with its textures."""
    pixels = np.full((64, 64, 4), 255, np.uint8)
    mesh = surface_of_scene(textured_quad(pixels))
    floats = 64 * 64 * 4 * 4
    assert floats + pixels.nbytes < AreaSurface(mesh).size_bytes < 4 / 3 * floats + pixels.nbytes + 4096
    kept = VisibleSurface(nested_balls(), pool_size=1000)
    assert kept.size_bytes == 1000 * 6 * 4


def test_visible_points_face_outwards_and_are_even(tmp_path):
    write_surface_mesh(tmp_path / "mesh.obj", nested_balls())
    points, normals, rgb = visible_surface_points(tmp_path / "mesh.obj", 5000, 0)
    again = visible_surface_points(tmp_path / "mesh.obj", 5000, 0)
    for first, second in zip((points, normals, rgb), again, strict=True):
        np.testing.assert_array_equal(first, second)
    outwards = points - (0.0, 0.0, 1.0)
    assert points.shape == normals.shape == rgb.shape == (5000, 3)
    assert (outwards * normals).sum(-1).min() > 0.95
    upper = outwards[outwards[:, 2] > 0.0]  # all seen: heights of points on a sphere are uniform
    assert stats.kstest(upper[:, 2], "uniform").pvalue > 1e-4


def test_cut_outs_carry_no_points():
    pixels = np.full((2, 16, 4), 255, np.uint8)
    pixels[:, 8:, 3] = 0  # the right half is not there
    surface = AreaSurface(surface_of_scene(textured_quad(pixels, alphaMode="MASK", alphaCutoff=0.5)))
    points = surface.sample(2000, generator()).points[0]
    inside = points[(points[:, 0] > 0.04) & (points[:, 0] < 0.96)]  # the repeated texture blends at its ends
    assert float(inside[:, 0].max()) < 0.51
    opaque = AreaSurface(surface_of_scene(textured_quad(pixels))).sample(2000, generator()).points[0]
    assert float(opaque[:, 0].max()) > 0.95


def test_areas_are_geometry():
    assert triangle_areas(two_parts()).sum() == pytest.approx(4.0)
