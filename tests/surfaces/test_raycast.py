"""Rays that meet triangles, and those that cut-outs let through."""

import numpy as np
import torch
import trimesh

from charnerf.geometry.framing import source_cameras
from charnerf.surfaces.raycast import RayCaster
from charnerf.surfaces.scene_mesh import surface_of_scene
from support.surfaces import textured_quad


def test_rays_meet_a_ball_where_the_formula_says():
    rng = np.random.default_rng(0)
    caster = RayCaster(
        trimesh.creation.icosphere(subdivisions=6).apply_translation((0.0, 0.0, 1.0)).triangles
    )
    origins = np.tile(np.array((0.0, -4.0, 1.0), np.float32), (2000, 1))
    directions = np.stack(
        (rng.uniform(-0.3, 0.3, 2000), np.ones(2000), rng.uniform(-0.3, 0.3, 2000)), axis=-1
    )
    directions = (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).astype(np.float32)
    hits = caster.first_hits(origins, directions)
    along = directions[:, 1] * 4.0
    inside = along**2 - 15.0
    assert ((hits.triangles >= 0) == (inside > 0))[np.abs(inside) > 0.02].all()
    sure = inside > 0.02
    np.testing.assert_allclose(hits.distances[sure], along[sure] - np.sqrt(inside[sure]), atol=3e-3)
    assert np.isinf(hits.distances[hits.triangles < 0]).all()


def test_cut_outs_let_rays_through_and_hide_nothing():
    """Of two squares one behind the other, the nearer lacks its right half: there the farther one is met."""
    pixels = np.full((2, 16, 4), 255, np.uint8)
    pixels[:, 8:, 3] = 0
    near = textured_quad(pixels, alphaMode="MASK", alphaCutoff=0.5)
    far = textured_quad(pixels[..., :3]).apply_translation((0.0, 1.0, 0.0))
    caster = RayCaster.of_surface(surface_of_scene(trimesh.Scene([near, far])))
    origins = np.array([[0.25, -3.0, 0.5], [0.75, -3.0, 0.5], [1.5, -3.0, 0.5]], np.float32)
    forward = np.tile(np.array((0.0, 1.0, 0.0), np.float32), (3, 1))
    hits = caster.first_hits(origins, forward)
    np.testing.assert_allclose(hits.distances, (3.0, 4.0, np.inf), atol=1e-4)
    np.testing.assert_allclose(hits[hits.hit].points[:, 1], (0.0, 1.0), atol=1e-4)
    assert caster.occluded(origins, forward).tolist() == [True, True, False]
    reached = caster.reaches(
        origins, forward, triangles=hits.triangles, distances=np.full(3, 4.0), tolerance=0.01
    )
    assert reached.tolist() == [True, True, True]
    behind = caster.reaches(
        origins, forward, triangles=np.full(3, -1), distances=np.full(3, 4.0), tolerance=0.01
    )
    assert behind.tolist() == [False, True, True]


def test_rays_of_pixels_are_those_of_the_camera():
    """The middle pixel of the front camera meets a ball nearest, at the camera's distance less the radius."""
    ball = trimesh.creation.icosphere(subdivisions=4).apply_translation((0.0, 0.0, 1.0))
    camera = source_cameras(radius=1.2, size=32)[0]
    hits = RayCaster(ball.triangles).pixel_hits(camera, torch.tensor([[16.0, 16.0], [1.0, 1.0]]))
    assert hits.hit.tolist() == [True, False]
    np.testing.assert_allclose(hits[hits.hit].points, [(0.0, -1.0, 1.0)], atol=1e-3)
