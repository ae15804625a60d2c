"""Optical depths in closed form, and surfaces where a density alone has holes."""

import itertools

import numpy as np
import pytest

from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid import Grid
from charnerf.meshing.optical_depth import AHEAD, SURFACE, least_optical_depth, surface_values
from charnerf.types import LeftOut


def test_the_depth_in_a_slab_is_its_density_times_the_distance_to_the_nearer_side():
    """A slab across x, between empty layers: the trapezoid rule gives its first cell half."""
    densities = np.zeros((21, 61, 61), np.float32)
    densities[1:-1] = 3.0
    depths = least_optical_depth(densities, 0.1)[:, 30, 30]
    from_side = np.minimum(np.arange(21), np.arange(21)[::-1])
    np.testing.assert_allclose(depths, 3.0 * 0.1 * np.maximum(from_side - 0.5, 0.0), rtol=1e-5)


def test_the_depth_in_a_ball_is_its_density_times_the_distance_to_its_surface_along_the_clearest_of_26_ways():
    """In the middle all ways are as long; towards a corner of the grid the diagonal is the shortest."""
    axis = np.linspace(-1.25, 1.25, 101)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    ball = np.clip((1.0 - np.sqrt(x**2 + y**2 + z**2)) / 0.05 + 0.5, 0.0, 1.0).astype(np.float32)
    depths = least_optical_depth(4.0 * ball, 0.025)
    assert depths[50, 50, 50] == pytest.approx(4.0, rel=0.01)
    for towards in ((1, 0, 0), (0, -1, 1), (1, 1, -1)):
        index = 50 + 10 * np.array(towards)
        away = 0.25 * np.linalg.norm(towards)
        assert depths[tuple(index)] == pytest.approx(4.0 * (1.0 - away), rel=0.02)


def test_depths_do_not_depend_on_how_the_grid_lies():
    densities = np.random.default_rng(0).uniform(0.0, 9.0, (6, 7, 8)).astype(np.float32)
    depths = least_optical_depth(densities, 0.2)
    for order in itertools.permutations(range(3)):
        np.testing.assert_allclose(
            least_optical_depth(densities.transpose(order), 0.2), depths.transpose(order), rtol=1e-5
        )
        mirrored = least_optical_depth(np.flip(densities, order[0]), 0.2)
        np.testing.assert_allclose(mirrored, np.flip(depths, order[0]), rtol=1e-5)


@pytest.mark.parametrize("largest", [0.0, 1e-30, 1e30])
def test_extreme_densities_stay_ordered_and_never_nan(largest):
    densities = np.full((5, 5, 5), largest, np.float32)
    values = surface_values(densities, 1e-3)
    assert not np.isnan(values).any() and (values >= 0.0).all()
    assert values[2, 2, 2] >= values[0, 0, 0]


def test_what_is_sharp_is_drawn_where_its_density_jumps():
    """A block as dense as SURFACE / AHEAD needs no depth at all; one a tenth as dense begins as deep as the light goes."""
    sides = []
    for density in (SURFACE / AHEAD, 0.1 * SURFACE / AHEAD):
        densities = np.zeros((65, 65, 65), np.float32)
        densities[16:49, 16:49, 16:49] = density
        grid = Grid(surface_values(densities, 0.01), np.zeros(3), 0.01, LeftOut())
        sides.append(extract_surface(grid, SURFACE).mesh.bounds[0, 0])
    assert sides[0] == pytest.approx(0.16, abs=0.01)
    assert sides[1] == pytest.approx(0.155 + SURFACE / (0.1 * SURFACE / AHEAD) - AHEAD, abs=0.01)


def test_haze_of_uncertain_depth_is_one_body_where_no_density_is():
    """Densities that flicker about 6/m in 40 cm: at any one of them the surface is many parts, by depth it is one."""
    flicker = np.random.default_rng(1).gamma(1.0, 6.0, (40, 40, 40))
    densities = np.pad(flicker, 4).astype(np.float32)
    by_depth = Grid(surface_values(densities, 0.01), np.zeros(3), 0.01, LeftOut())
    by_density = Grid(densities, np.zeros(3), 0.01, LeftOut())
    body, holes = extract_surface(by_depth, SURFACE), extract_surface(by_density, 6.0)
    assert body.mesh.volume > 0.2 * 0.4**3
    assert abs(body.mesh.euler_number) < 0.2 * abs(holes.mesh.euler_number)
