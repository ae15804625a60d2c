"""Which colours of a scene mean what."""

import numpy as np
import pytest
import trimesh

from charnerf.surfaces.scene_mesh import COLORS_KEY, FACTOR_KEY, surface_of_scene
from charnerf.surfaces.surface_mesh import shade
from support.surfaces import textured_quad


def test_texture_rows_run_down_and_factors_multiply_light():
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[0] = (200, 0, 0)  # the upper row
    quad = textured_quad(pixels)
    quad.metadata[FACTOR_KEY] = (0.5, 1.0, 1.0, 1.0)
    mesh = surface_of_scene(quad)
    upper = shade(mesh, np.array([1]), np.array([0.25]), np.array([0.5]))[0]  # at (0.25, 0.75)
    light = ((200 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(upper, (0.5 * light, 0.0, 0.0, 1.0), atol=1e-6)
    lower = shade(mesh, np.array([0]), np.array([0.5]), np.array([0.25]))[0]  # at (0.75, 0.25)
    np.testing.assert_allclose(lower, (0.0, 0.0, 0.0, 1.0), atol=1e-6)


@pytest.mark.parametrize(
    "encoding, light", [("srgb", ((128 / 255 + 0.055) / 1.055) ** 2.4), (None, 128 / 255)]
)
def test_vertex_and_face_colors_mean_what_their_file_means(encoding, light):
    for kind in ("vertex_colors", "face_colors"):
        mesh = trimesh.creation.box()
        if encoding:
            mesh.metadata[COLORS_KEY] = encoding
        setattr(mesh.visual, kind, (128, 128, 128, 0))
        surface = surface_of_scene(mesh)
        np.testing.assert_allclose(surface.colors[..., :3], light, atol=1e-6)
        assert (surface.colors[..., 3] == 1.0).all()


def test_grey_of_sixteen_bits_is_not_clipped():
    quad = textured_quad(np.full((2, 2), 128 * 257, np.uint16))
    texture = surface_of_scene(quad).materials[0].texture
    assert texture is not None and (texture.pixels == (128, 128, 128, 255)).all()
