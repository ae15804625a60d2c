"""Grids of densities and their optical depths: averaging, leaving out, and that it costs nothing."""

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from charnerf.errors import DataError, NumericalError
from charnerf.meshing.density import averaged_density, camera_positions
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.optical_depth import SURFACE
from charnerf.types import FieldOutput
from support.analytic_scenes import box_hull, figure, scene_of, sphere, with_field


def _hull_around(distance, margin: float, cells: int = 64):
    low, high = torch.tensor([-1.4, -1.4, -0.4]), torch.tensor([1.4, 1.4, 2.4])
    axis = (torch.arange(cells) + 0.5) / cells
    centres = low + (high - low) * torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), dim=-1)
    return box_hull((distance(centres.reshape(-1, 3)) > -margin).reshape(cells, cells, cells), low, high)


@pytest.mark.parametrize("with_hull", [False, True])
@pytest.mark.parametrize("shape", [sphere, figure])
def test_surface_blocks_give_the_mesh_of_the_full_grid(shape, with_hull):
    """To a tenth of a cell: what lies far before a surface is read between every second point."""
    scene = scene_of(shape, width=0.1, hull=_hull_around(shape, 0.06) if with_hull else None)
    sparse = GridSampler(scene, resolution=64, num_cameras=1).evaluate_surface(SURFACE)
    full = GridSampler(scene, resolution=64, num_cameras=1).evaluate_all()
    first, second = extract_surface(sparse, SURFACE).mesh, extract_surface(full, SURFACE).mesh
    for one, other in ((first, second), (second, first)):
        assert cKDTree(one.vertices).query(other.vertices)[0].max() < sparse.spacing / 10
    assert abs(first.volume / second.volume - 1.0) < 1e-3
    assert sparse.left_out.grid_cells > full.left_out.grid_cells
    assert sparse.left_out.grid_cells_of == sparse.values.size


def test_left_out_counts_the_points_that_the_field_never_saw():
    seen = []
    scene = scene_of(figure, hull=_hull_around(figure, 0.06))
    field = scene.field

    def counting(points, view_dirs):
        seen.append(len(points))
        return field(points, view_dirs)

    scene = with_field(scene, counting)
    grid = GridSampler(scene, resolution=64, num_cameras=8).evaluate_surface(SURFACE)
    assert sum(seen) == grid.left_out.grid_cells_of - grid.left_out.grid_cells
    assert grid.left_out.grid_cells > 0.8 * grid.left_out.grid_cells_of


def test_outside_the_hull_is_empty_and_never_asked():
    def refuses(points, view_dirs):
        assert bool((points[:, 2] < 1.0).all())
        return FieldOutput(rgb=torch.ones_like(points), densities=torch.full((len(points),), 50.0))

    occupancy = torch.zeros(4, 4, 4, dtype=torch.bool)
    occupancy[..., :2] = True  # z < 1
    low, high = torch.tensor([-1.0, -1.0, 0.0]), torch.tensor([1.0, 1.0, 2.0])
    scene = with_field(scene_of(sphere, hull=box_hull(occupancy, low, high)), refuses)
    points = torch.rand(500, 3) * 2 - torch.tensor([1.0, 1.0, 0.0])
    densities = averaged_density(scene, points, 3)
    torch.testing.assert_close(densities, torch.where(points[:, 2] < 1.0, 50.0, 0.0))


def test_average_over_cameras_is_the_mean_of_their_answers():
    def directed(points, view_dirs):
        return FieldOutput(rgb=torch.ones_like(points), densities=2.0 + view_dirs[:, 0])

    scene = with_field(scene_of(sphere), directed, sees_directions=True)
    points = torch.rand(7, 3)
    offset = points[:, None] - camera_positions(scene, 5)
    expected = 2.0 + (offset / offset.norm(dim=-1, keepdim=True))[..., 0].mean(1)
    torch.testing.assert_close(averaged_density(scene, points, 5), expected)


def test_average_of_a_field_without_directions_is_the_field():
    seeing = scene_of(figure, sees_directions=True)
    blind = scene_of(figure, sees_directions=False)
    points = torch.rand(200, 3)
    torch.testing.assert_close(averaged_density(seeing, points, 6), averaged_density(blind, points, 6))


def test_border_is_empty_even_where_the_field_is_not():
    scene = scene_of(lambda points: torch.ones(len(points)))
    grid = GridSampler(scene, resolution=20, num_cameras=1).evaluate_all()
    for axis in range(3):
        layers = np.moveaxis(grid.values, axis, 0)
        assert not layers[0].any() and not layers[-1].any()
    mesh = extract_surface(grid, SURFACE).mesh
    assert mesh.is_watertight and mesh.euler_number == 2


def test_bad_input_is_named():
    with pytest.raises(NumericalError, match=r"density field: found 5 of 5 values not finite"):
        averaged_density(scene_of(lambda points: points[:, 0] * float("nan")), torch.rand(5, 3), 1)
    with pytest.raises(DataError, match="resolution: found 4"):
        GridSampler(scene_of(sphere), resolution=4, num_cameras=1)
    empty = box_hull(torch.zeros(4, 4, 4, dtype=torch.bool), torch.zeros(3), torch.ones(3))
    with pytest.raises(DataError, match="no occupied cell"):
        GridSampler(scene_of(sphere, hull=empty), resolution=32, num_cameras=1)
