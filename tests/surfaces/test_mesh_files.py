"""Mesh files, written and read."""

import numpy as np
import pytest
import trimesh

from charnerf.errors import DataError
from charnerf.surfaces.mesh_files import load_surface_mesh, write_surface_mesh
from charnerf.surfaces.scene_mesh import FACTOR_KEY, surface_of_scene
from charnerf.surfaces.surface_mesh import shade
from support.surfaces import textured_quad


def test_files_keep_shape_and_look(tmp_path):
    rng = np.random.default_rng(0)
    quad = textured_quad(rng.integers(0, 256, (8, 8, 4), dtype=np.uint8), alphaMode="MASK", alphaCutoff=0.25)
    quad.metadata[FACTOR_KEY] = (0.3, 0.6, 0.9, 0.8)
    box = trimesh.creation.box()
    box.visual.vertex_colors = rng.integers(0, 256, (8, 4), dtype=np.uint8)
    box.apply_translation((3.0, 0.0, 0.0))
    before = surface_of_scene(trimesh.Scene([quad, box]))
    (tmp_path / "mesh").mkdir()
    write_surface_mesh(tmp_path / "mesh/mesh.obj", before)
    after = load_surface_mesh(tmp_path / "mesh/mesh.obj")
    np.testing.assert_allclose(after.triangles, before.triangles, atol=1e-6)
    np.testing.assert_allclose(after.uvs, before.uvs, atol=1e-6)
    assert sorted(path.suffix for path in (tmp_path / "mesh").iterdir()) == [".mtl", ".obj", ".png"]
    triangles = rng.integers(0, len(before.triangles), 500)
    u = rng.uniform(0.0, 0.5, 500)
    v = rng.uniform(0.0, 0.5, 500)
    first, second = shade(before, triangles, u, v), shade(after, triangles, u, v)
    there = first[:, 3] > 0
    assert (there == (second[:, 3] > 0)).mean() > 0.98  # 8-bit alpha
    np.testing.assert_allclose(first[there, :3], second[there, :3], atol=6e-3)
    assert 0.0 < (~there).mean() < 0.9


@pytest.mark.parametrize(
    "content, message",
    [
        (None, "no such file"),
        (
            "# charnerf mesh 1: metres, +Z up, facing -Y; v x y z r g b with sRGB colours\n",
            "no such file, named",
        ),
        ("v 0 0 0\n", "mesh"),
        ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    ],
)
def test_wrong_mesh_files_are_named(tmp_path, content, message):
    if content is not None:
        (tmp_path / "mesh.obj").write_text(content)
    with pytest.raises(DataError, match=message) as caught:
        load_surface_mesh(tmp_path / "mesh.obj")
    assert str(tmp_path) in str(caught.value)
