"""The symmetric scene: its own mirror image, whatever the hull's box."""

import dataclasses

import pytest
import torch
from scipy.spatial import cKDTree

from charnerf.geometry.hull import hull_contains
from charnerf.meshing.density import averaged_density
from charnerf.meshing.distance import surface_chamfer_mm
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.optical_depth import SURFACE
from charnerf.meshing.symmetry import symmetric_hull, symmetric_scene
from charnerf.scene import Scene
from support.analytic_scenes import box_hull, capsule, figure, scene_of, with_field


def _lopsided(points: torch.Tensor) -> torch.Tensor:
    return torch.maximum(figure(points), capsule(points, (0.3, 0.0, 1.2), (0.5, -0.2, 1.0), 0.12))


def _scene(shape=_lopsided, hull=None) -> Scene:
    return scene_of(shape, width=0.1, hull=hull)


def _hull(shape, low=(-1.0, -0.9, -0.1), high=(1.35, 0.9, 2.2), cells=40):
    low, high = torch.tensor(low), torch.tensor(high)
    axis = (torch.arange(cells) + 0.5) / cells
    centres = low + (high - low) * torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), dim=-1)
    return box_hull((shape(centres.reshape(-1, 3)) > -0.1).reshape(cells, cells, cells), low, high)


@pytest.mark.parametrize("with_hull", [False, True])
def test_density_is_the_mean_of_both_sides(with_hull):
    scene = _scene(hull=_hull(_lopsided) if with_hull else None)
    points = torch.rand(4000, 3) * torch.tensor([2.6, 1.6, 2.3]) - torch.tensor([1.3, 0.8, 0.1])
    flip = torch.tensor([-1.0, 1.0, 1.0])
    expected = 0.5 * (averaged_density(scene, points, 1) + averaged_density(scene, points * flip, 1))
    made = symmetric_scene(scene)
    found = averaged_density(made, points, 1)
    torch.testing.assert_close(found, expected)
    torch.testing.assert_close(averaged_density(made, points * flip, 1), found)
    torch.testing.assert_close(made.field(points, torch.zeros_like(points)).densities, expected)


def test_the_mesh_is_its_own_mirror_image():
    scene = symmetric_scene(_scene(hull=_hull(_lopsided)))
    sampler = GridSampler(scene, resolution=64, num_cameras=1)
    grid = sampler.evaluate_surface(SURFACE)
    mesh = extract_surface(grid, SURFACE).mesh
    mirror = mesh.copy()
    mirror.vertices = mesh.vertices * (-1.0, 1.0, 1.0)
    away = cKDTree(mesh.vertices).query(mirror.vertices)[0]
    assert away.max() < grid.spacing  # each vertex' mirror image lies beside the surface
    assert surface_chamfer_mm(mesh, mirror) < 2.0  # a cell is 40 mm
    assert mesh.is_watertight and abs(mesh.center_mass[0]) < 1e-3


def test_a_symmetric_scene_stays_as_it_is():
    scene = _scene(figure)
    points = torch.rand(500, 3) * 2 - torch.tensor([1.0, 1.0, 0.0])
    before, after = scene.field(points, points), symmetric_scene(scene).field(points, points)
    torch.testing.assert_close(after.densities, before.densities, rtol=1e-4, atol=1e-4)


def test_colors_stay_on_their_side():
    """A badge on one side is not doubled; a side that is empty takes the other's colour."""
    plain = _scene(figure)

    def badged(points, view_dirs):
        answer = plain.field(points, view_dirs)
        rgb = torch.where(
            (points[:, 0] > 0)[:, None], points.new_tensor((1.0, 0, 0)), points.new_tensor((0, 0, 1.0))
        )
        return dataclasses.replace(answer, rgb=rgb)

    made = symmetric_scene(with_field(plain, badged))
    points = torch.tensor([[0.1, 0.0, 1.2], [-0.1, 0.0, 1.2]])
    answer = made.field.densities(points, torch.zeros(2, 3))
    rgb = made.field.colors(answer.state)
    assert rgb[0, 0] > 0.98 and rgb[1, 2] > 0.98


def test_the_hull_holds_both_sides():
    hull = _hull(_lopsided)
    wide = symmetric_hull(hull)
    points = torch.rand(20_000, 3) * torch.tensor([2.8, 1.8, 2.3]) - torch.tensor([1.4, 0.9, 0.1])
    flip = torch.tensor([-1.0, 1.0, 1.0])
    needed = hull_contains(hull, points) | hull_contains(hull, points * flip)
    assert bool(hull_contains(wide, points)[needed].all())
    assert torch.equal(wide.occupancy, wide.occupancy.flip(0))
    assert float(hull_contains(wide, points).float().mean()) < 1.6 * float(needed.float().mean())


def test_outlines_hold_where_either_side_does():
    scene = _scene()
    bounds = dataclasses.replace(scene.bounds, outlines=lambda points: points[:, 0] > 0.5)
    left_only = dataclasses.replace(scene, bounds=bounds)
    points = torch.tensor(((0.7, 0.0, 1.0), (-0.7, 0.0, 1.0), (0.2, 0.0, 1.0)))
    assert symmetric_scene(left_only).bounds.outlines(points).tolist() == [True, True, False]
    assert symmetric_scene(scene).bounds.outlines is None
