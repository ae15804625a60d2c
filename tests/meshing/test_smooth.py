"""Smoothing takes roughness away and nothing else."""

import numpy as np
import pytest
import trimesh

from charnerf.errors import DataError
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid import Grid
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.smooth import smooth_mesh
from charnerf.types import LeftOut
from support.analytic_scenes import figure, scene_of, sphere

CENTRE = np.array([0.03, -0.07, 1.02])


def _surface(shape, resolution: int) -> trimesh.Trimesh:
    """Where the density is 100/m: there the distance is 0."""
    sampler = GridSampler(scene_of(shape, width=0.3), resolution=resolution, num_cameras=1)
    sampler.evaluate(np.ones(sampler.shape, bool))
    return extract_surface(Grid(sampler.values, sampler.origin, sampler.spacing, LeftOut()), 100.0).mesh


@pytest.mark.parametrize("rounds", [5, 20, 60])
def test_a_sphere_keeps_its_radius(rounds):
    mesh = smooth_mesh(_surface(sphere, 64), rounds)
    radii = np.linalg.norm(mesh.vertices - CENTRE, axis=1)
    assert radii.mean() == pytest.approx(1.0, abs=1e-3)
    assert mesh.volume == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert mesh.is_watertight and mesh.euler_number == 2


def test_roughness_goes():
    smooth = _surface(sphere, 64)
    rng = np.random.default_rng(0)
    rough = smooth.copy()
    rough.vertices = (
        smooth.vertices + 0.005 * rng.standard_normal((len(smooth.vertices), 1)) * smooth.vertex_normals
    )
    mended = smooth_mesh(rough, 10)
    before, after = (np.linalg.norm(m.vertices - CENTRE, axis=1).std() for m in (rough, mended))
    assert after < 0.4 * before
    assert np.array_equal(mended.faces, rough.faces)


def test_limbs_stay():
    mesh = _surface(figure, 64)
    smooth = smooth_mesh(mesh, 10)
    assert smooth.volume == pytest.approx(mesh.volume, rel=0.01)
    np.testing.assert_allclose(smooth.extents, mesh.extents, rtol=0.01)


def test_no_round_is_no_change():
    mesh = trimesh.creation.box()
    assert smooth_mesh(mesh, 0) is mesh
    with pytest.raises(DataError, match="smooth: found -1 rounds"):
        smooth_mesh(mesh, -1)
