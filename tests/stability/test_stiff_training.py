"""Trainings that break naive trainers end in finite numbers or in a clear error; none in silent NaN."""

import math

import numpy as np
import pytest
import torch
import trimesh

from charnerf.data.surface import AreaSurface
from charnerf.errors import DataError
from charnerf.geometry.cameras import pixel_rays
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.types import RayBundle
from support import stiff

ALWAYS = (
    "learning rate x 100",
    "all-black drawings",
    "all-white drawings",
    "one-pixel silhouettes",
    "character fills the frame",
    "character leaves the frame",
    "all views empty, without a hull",
    "phase switch",
    "bfloat16 autocast",
)
SELDOM = (
    "thin rod between balls",
    "one view",
    "learning rate x 100, paper's model",
    "duplicated views",
    "ReLU density",
    "piecewise linear quadrature",
)


@pytest.fixture(scope="module")
def ordinary() -> stiff.Fit:
    return stiff.cases()["ordinary"]()


@pytest.mark.parametrize("name", [*ALWAYS, *(pytest.param(name, marks=pytest.mark.slow) for name in SELDOM)])
def test_ends_in_finite_numbers(name):
    assert stiff.cases()[name]().finite


def test_an_empty_view_is_named():
    with pytest.raises(DataError, match="source view 1: found an empty silhouette"):
        stiff.cases()["one empty view"]()


def test_a_spike_is_forgotten(ordinary):
    """One batch of loss 1e12 must not undo the training: gradients are clipped."""
    spiked = stiff.cases()["loss spike of 1e12"]()
    assert spiked.finite
    assert max(spiked.losses) > 1e9
    assert spiked.losses[-1] < spiked.losses[0]


def test_an_ordinary_training_learns_and_stays_opaque(ordinary):
    assert ordinary.losses[-1] < 0.8 * ordinary.losses[0]
    assert ordinary.opacity > 0.5


@pytest.mark.parametrize("unit", ["in millimetres", pytest.param("in kilometres", marks=pytest.mark.slow)])
def test_the_unit_of_length_changes_nothing(ordinary, unit):
    """Alpha Invariance (2024): with the density scaled by the scene's length every step is the same."""
    other = stiff.cases()[unit]()
    torch.testing.assert_close(
        torch.tensor(other.losses), torch.tensor(ordinary.losses), rtol=1e-2, atol=1e-4
    )


def test_the_unit_matters_where_the_density_is_not_scaled(ordinary):
    """In millimetres with densities per metre the figure starts opaque everywhere: the check can fail."""
    base = stiff.ordinary()
    unscaled = stiff.fit(
        stiff.moved(base, stiff.Motion("", scale=1e3)), length=1e3, density_length=1.0, steps=1
    )
    assert abs(unscaled.losses[0] - ordinary.losses[0]) > 0.1 * ordinary.losses[0]


def sample(vertices: np.ndarray, faces: np.ndarray, count: int) -> torch.Tensor:
    surface = AreaSurface(surface_of_scene(trimesh.Trimesh(vertices, faces, process=False)))
    return surface.sample(count, torch.Generator().manual_seed(0)).points[0]


def test_a_mesh_of_one_triangle():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 2.0]])
    points = sample(corners, np.array([[0, 1, 2]]), 500)
    assert points.isfinite().all()
    torch.testing.assert_close(2.0 * points[:, 1], points[:, 2], rtol=0, atol=1e-6)


def test_triangles_without_area_get_no_points():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 1.0], [5.0, 5.0, 5.0]])
    points = sample(corners, np.array([[0, 1, 2], [4, 4, 4], [0, 1, 3]]), 500)
    assert points.isfinite().all() and points.amax() <= 1.0
    with pytest.raises(DataError, match="area"):
        sample(corners, np.array([[0, 1, 2], [4, 4, 4]]), 10)


@pytest.mark.slow
def test_a_mesh_of_two_million_triangles():
    side = 1001
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    vertices = np.stack((x, y, np.ones_like(x)), axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    faces = np.concatenate(
        (
            np.stack((corner, corner + 1, corner + side), -1),
            np.stack((corner + 1, corner + side + 1, corner + side), -1),
        )
    )
    points = sample(vertices, faces, 5000)
    assert points.isfinite().all() and points[:, 2].sub(1.0).abs().max() < 1e-6
    assert math.isclose(float(points[:, 0].mean()), 0.5, abs_tol=0.03)


def test_rays_beside_the_character_train_nothing_and_break_nothing():
    """A batch whose rays all miss the hull is white by definition: no gradient, no NaN."""
    base = stiff.ordinary()

    def astray(batch):
        away = pixel_rays(base.cameras[0], torch.full((stiff.RAYS, 2), -500.0))
        return stiff.replace(batch, rays=RayBundle(away.origins[None], away.directions[None]))

    done = stiff.fit(base, change=astray, steps=2)
    assert done.finite
