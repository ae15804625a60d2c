"""PLY files with polygons, in every form."""

import numpy as np
import pytest

from charnerf.errors import DataError
from charnerf.surfaces.plain_ply import plain_faces
from charnerf.surfaces.scene_files import read_scene
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import triangle_areas
from support.gltf_files import png
from support.polygon_files import LETTER_C, write_ply

FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]
VERTICES = [(x, y, 0.0) for x, y in LETTER_C] + [
    (5.0, 0.0, 0.0),
    (6.0, 0.0, 0.0),
    (6.0, 1.0, 0.0),
    (5.0, 1.0, 0.0),
]
LETTER, SQUARE, TRIANGLE = tuple(range(8)), (8, 9, 10, 11), (8, 9, 10)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "faces, area",
    [([LETTER], 5.0), ([LETTER, SQUARE], 6.0), ([TRIANGLE, LETTER, TRIANGLE], 6.0), ([SQUARE, SQUARE], 2.0)],
)
def test_polygons_of_any_lengths_keep_their_openings(tmp_path, form, faces, area):
    file = write_ply(tmp_path / "a.ply", VERTICES, faces, form=form)
    assert triangle_areas(surface_of_scene(read_scene(file))).sum() == pytest.approx(area, abs=1e-5)


@pytest.mark.parametrize("form", FORMS)
def test_polygons_keep_their_colors(tmp_path, form):
    colors = [(255, 0, 0), (0, 0, 255)]
    file = write_ply(tmp_path / "a.ply", VERTICES, [LETTER, SQUARE], form=form, face_colors=colors)
    surface = surface_of_scene(read_scene(file))
    is_letter = surface.triangles[:, :, 0].max(axis=1) < 3.0
    np.testing.assert_array_equal(surface.colors[is_letter][..., :3].reshape(-1, 3), [(1, 0, 0)] * 18)
    np.testing.assert_array_equal(surface.colors[~is_letter][..., :3].reshape(-1, 3), [(0, 0, 1)] * 6)


@pytest.mark.parametrize("form", FORMS)
def test_polygons_keep_their_corners_coordinates(tmp_path, form):
    """Also where two faces meet a vertex with others."""
    (tmp_path / "my skin.png").write_bytes(png())
    faces = [LETTER, SQUARE]
    texcoords = [
        [value / 10 + index for corner in face for value in VERTICES[corner][:2]]
        for index, face in enumerate(faces)
    ]
    file = write_ply(
        tmp_path / "a.ply",
        VERTICES,
        faces,
        form=form,
        texcoords=texcoords,
        comment="comment TextureFile my skin.png\n",
    )
    surface = surface_of_scene(read_scene(file))
    shift = (surface.triangles[:, :, :1].max(axis=1, keepdims=True) > 3.0).astype(float)
    np.testing.assert_allclose(surface.uvs, surface.triangles[..., :2] / 10 + shift, atol=1e-6)
    assert surface.materials[0].texture is not None


@pytest.mark.parametrize("form", FORMS)
def test_files_of_triangles_stay_as_they_are(tmp_path, form):
    for more in ({}, {"face_colors": [(1, 2, 3)] * 2}):
        content = write_ply(tmp_path / "a.ply", VERTICES, [TRIANGLE] * 2, form=form, **more).read_bytes()
        assert plain_faces(content) is content


@pytest.mark.parametrize("form", FORMS)
def test_bad_ply_files_are_named(tmp_path, form):
    file = write_ply(tmp_path / "a.ply", VERTICES, [(0, 1, 2, 40)], form=form)
    with pytest.raises(DataError, match=r"a\.ply: a face names a vertex that is not one of 12"):
        read_scene(file)
    write_ply(file, VERTICES, [SQUARE], form=form, comment="comment TextureFile gone.png\n")
    with pytest.raises(DataError, match=r"a\.ply: names gone\.png, which is not in its folder"):
        read_scene(file)
    write_ply(file, VERTICES, [SQUARE, TRIANGLE], form=form)
    file.write_bytes(file.read_bytes()[:-8])
    with pytest.raises(DataError, match=r"a\.ply: "):
        read_scene(file)
