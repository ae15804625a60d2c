"""Pictures of meshes: true colours at true places."""

import numpy as np
import torch
import trimesh

from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.surfaces.render import render_clay, render_mesh


def _box() -> trimesh.Trimesh:
    mesh = trimesh.creation.box(bounds=[(-0.5, -0.5, 0.0), (0.5, 0.5, 2.0)])
    rgba = np.full((len(mesh.vertices), 4), 255, np.uint8)
    rgba[:, :3] = (40, 120, 200)
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=rgba)
    return mesh


def _cameras(*azimuths: float):
    angles = torch.tensor(azimuths)
    return cameras_towards(
        direction_from_angles(angles, torch.zeros_like(angles)),
        target=torch.tensor([0.0, 0.0, 1.0]),
        distance=4.0,
        half_extent=2.0,
        size=32,
        orthographic=True,
    )


def test_colors_are_those_of_the_vertices_and_outlines_exact():
    (picture,) = render_mesh(_box(), _cameras(0.0))
    np.testing.assert_allclose(picture[16, 16], (40 / 255, 120 / 255, 200 / 255, 1.0), atol=1e-3)
    assert picture[..., 3].sum() == 8 * 16  # 1 m x 2 m at 8 pixels a metre
    assert picture[16, 11, 3] == 0.0 and picture[16, 12, 3] == 1.0


def test_clay_is_grey_and_brightest_straight_on():
    mesh = trimesh.creation.icosphere(3, 1.0).apply_translation((0, 0, 1))
    (picture,) = render_clay(mesh, _cameras(0.0))
    assert np.ptp(picture[16, 16, :3]) < 1e-6
    assert picture[16, 16, 0] > picture[16, 22, 0] > picture[16, 23, 0]
