"""Surfaces: exactness on a sphere, floaters, decimation."""

import numpy as np
import pytest
import torch
import trimesh

from charnerf.errors import DataError, NumericalError
from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.meshing.build import build_mesh
from charnerf.meshing.extract import drop_floaters, extract_surface, fit_height, simplify
from charnerf.meshing.grid import Grid
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.optical_depth import AHEAD, SURFACE
from charnerf.meshing.options import MeshOptions
from charnerf.types import LeftOut, SourceViews
from support.analytic_scenes import capsule, figure, scene_of, sphere

CENTRE = np.array([0.03, -0.07, 1.02])


def _sphere_mesh(resolution: int, width: float = 0.03) -> trimesh.Trimesh:
    sampler = GridSampler(scene_of(sphere, width=width), resolution=resolution, num_cameras=1)
    return extract_surface(sampler.evaluate_surface(SURFACE), SURFACE).mesh


def test_a_sphere_is_found_below_the_cell():
    """The density is sigmoid(4 (1 - r) / 0.03) 200/m, whose integral over r has a closed form."""
    mesh = _sphere_mesh(128)
    radii = np.linalg.norm(mesh.vertices - CENTRE, axis=1)
    r = np.linspace(0.9, 1.1, 20001)
    inward = 4.0 * (1.0 - r) / 0.03
    values = 200.0 * 0.03 / 4.0 * np.logaddexp(0.0, inward) + AHEAD * 200.0 / (1.0 + np.exp(-inward))
    expected = r[values >= SURFACE].max()
    assert np.abs(radii - expected).max() < 6e-3  # every vertex; a cell is 2.2e-2
    np.testing.assert_allclose(mesh.vertices.min(0) + mesh.vertices.max(0), 2 * CENTRE, atol=5e-3)
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * expected**3, rel=1e-2)
    assert mesh.is_watertight and mesh.euler_number == 2
    outward = ((mesh.triangles_center - CENTRE) * mesh.face_normals).sum(1)
    assert (outward > 0).all()


def test_a_sphere_converges_with_second_order():
    """The volume's error falls with the square of the cell, towards that of a fine grid."""
    sizes = (24, 48, 96)
    finest = _sphere_mesh(192, width=0.25).volume
    slope = np.polyfit(
        np.log(sizes), np.log([abs(_sphere_mesh(n, width=0.25).volume - finest) for n in sizes]), 1
    )[0]
    assert slope == pytest.approx(-2.0, abs=0.4)


def _ball(radius: float, x: float) -> trimesh.Trimesh:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    ball.apply_translation((x, 0, 0))
    return ball


def test_floaters_go_and_held_props_stay():
    body, far_prop, near_buckle = _ball(1.0, 0.0), _ball(0.2, 2.0), _ball(0.05, 1.08)
    far_speck, near_dust = _ball(0.05, 2.0), _ball(0.01, 1.03)
    cavity = _ball(0.5, 0.0)
    cavity.invert()
    parts = [body, far_prop, near_buckle, far_speck, near_dust, cavity]
    mesh, floaters, cavities = drop_floaters(trimesh.util.concatenate(parts))
    assert (floaters, cavities) == (2, 1)
    assert mesh.volume == pytest.approx(body.volume + far_prop.volume + near_buckle.volume)


def test_empty_field_says_its_range():
    grid = Grid(np.full((8, 8, 8), 0.25, np.float32), np.zeros(3), 0.1, LeftOut())
    with pytest.raises(NumericalError, match=r"found values from 0.25 to 0.25.*above the surface's 15"):
        extract_surface(grid, 15.0)
    with pytest.raises(NumericalError, match=r"found values from 0 to 0.*The field is empty"):
        build_mesh(scene_of(sphere, peak=0.0), None, MeshOptions(resolution=32))
    with pytest.raises(DataError, match="level: found -1"):
        extract_surface(grid, -1.0)


def test_simplify_keeps_form_and_colors():
    mesh = _ball(1.0, 0.0).subdivide()
    colors = np.full((len(mesh.vertices), 4), 255, np.uint8)
    colors[mesh.vertices[:, 0] > 0, :3] = (10, 200, 30)
    mesh.visual.vertex_colors = colors
    small = simplify(mesh, 500)
    assert 490 <= len(small.faces) <= 500 and small.is_watertight and small.euler_number == 2
    assert small.volume == pytest.approx(mesh.volume, rel=0.01)
    right = small.vertices[:, 0] > 0.05
    assert (small.visual.vertex_colors[right, :3] == (10, 200, 30)).all()
    assert simplify(mesh, 10**6) is mesh


def test_height_is_exact_and_feet_on_the_floor():
    mesh = fit_height(_ball(0.7, 0.4), 2.0)
    assert mesh.bounds[0, 2] == 0.0 and mesh.bounds[1, 2] == pytest.approx(2.0, abs=1e-12)
    with pytest.raises(DataError, match="height: found 0"):
        fit_height(mesh, 0.0)


def _views_of(distance, size: int = 96) -> SourceViews:
    angles = torch.tensor([0.0, 90.0, 180.0])
    cameras = cameras_towards(
        direction_from_angles(angles, torch.zeros(3)),
        target=torch.tensor([0.0, 0.0, 1.0]),
        distance=4.0,
        half_extent=1.2,
        size=size,
        orthographic=True,
    )
    images = torch.zeros(1, 3, 4, size, size)
    centre = (torch.arange(size) + 0.5) / size * 2.4 - 1.2
    depth = torch.linspace(-1.2, 1.2, 60)
    z, across, deep = torch.meshgrid(1.0 - centre, centre, depth, indexing="ij")
    for v, (x, y) in enumerate(((across, deep), (deep, across), (-across, deep))):
        points = torch.stack((x, y, z), dim=-1).reshape(-1, 3)
        images[0, v, 3] = (distance(points) > 0).reshape(size, size, 60).any(-1).float()
    flags = torch.zeros(1, 3, dtype=torch.bool)
    return SourceViews(images, cameras[None], ~flags, flags)


def test_built_mesh_is_colored_and_of_the_asked_size():
    built = build_mesh(scene_of(figure), _views_of(figure), MeshOptions(resolution=96, faces=4000))
    mesh = built.mesh
    assert 3900 <= len(mesh.faces) <= 4000 < built.num_extracted
    assert mesh.bounds[0, 2] == 0.0 and mesh.extents[2] == pytest.approx(2.0, abs=1e-9)
    assert mesh.is_watertight and mesh.euler_number == 2 and built.num_floaters == 0
    blue = mesh.visual.vertex_colors[:, 2]
    assert (blue[mesh.vertices[:, 1] < -0.05] > 200).all() and (blue[mesh.vertices[:, 1] > 0.05] < 50).all()
    assert 0.5 < built.left_out.shares()["grid_cells"] < 1.0


def test_a_sword_held_loosely_survives():
    def armed(points):
        return torch.maximum(figure(points), capsule(points, (1.0, 0, 0.9), (1.0, 0, 1.9), 0.05))

    built = build_mesh(scene_of(armed, width=0.02), None, MeshOptions(resolution=96, height=None))
    assert len(built.mesh.split()) == 2 and built.num_floaters == 0
