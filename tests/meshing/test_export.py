"""Files: axes, colours, nothing half-written."""

import json

import numpy as np
import pytest
import trimesh

from charnerf.errors import DataError
from charnerf.meshing.export import SUFFIXES, save_mesh
from charnerf.surfaces.color import linear_from_srgb

Z_UP = (".ply", ".stl")


def _figure() -> trimesh.Trimesh:
    """2 m tall on the floor, nose towards -Y, a prop at its left (+X); dark red."""
    body = trimesh.creation.box(bounds=[(-0.3, -0.2, 0.0), (0.3, 0.2, 2.0)])
    nose = trimesh.creation.box(bounds=[(-0.05, -0.5, 1.7), (0.05, -0.3, 1.8)])
    prop = trimesh.creation.box(bounds=[(0.8, -0.1, 0.9), (0.9, 0.1, 1.0)])
    mesh = trimesh.util.concatenate([body, nose, prop])
    mesh.visual.vertex_colors = np.tile(np.array([[40, 12, 200, 255]], np.uint8), (len(mesh.vertices), 1))
    return mesh


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_axes_of_each_format(tmp_path, suffix):
    if suffix == ".usdz":
        pytest.skip("trimesh reads no USDZ; see test_usdz_*")
    path = save_mesh(_figure(), tmp_path / f"hero{suffix}")
    bounds = trimesh.load(path, force="mesh", process=False).bounds
    if suffix in Z_UP:
        expected = [(-0.3, -0.5, 0.0), (0.9, 0.2, 2.0)]
    else:
        expected = [(-0.3, 0.0, -0.2), (0.9, 2.0, 0.5)]
    np.testing.assert_allclose(bounds, expected, atol=1e-6)
    assert trimesh.load(path, force="mesh").volume > 0  # the axis change is a rotation, no mirroring


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_srgb_colors_stay_as_they_are(tmp_path, suffix):
    loaded = trimesh.load(save_mesh(_figure(), tmp_path / f"hero{suffix}"), force="mesh", process=False)
    assert (loaded.visual.vertex_colors == (40, 12, 200, 255)).all()


def _glb_parts(path):
    raw = path.read_bytes()
    length = int.from_bytes(raw[12:16], "little")
    return json.loads(raw[20 : 20 + length]), raw[20 + length + 8 :], raw


def test_glb_colors_are_linear_with_16_bits(tmp_path):
    document, binary, raw = _glb_parts(save_mesh(_figure(), tmp_path / "hero.glb"))
    assert int.from_bytes(raw[8:12], "little") == len(raw)
    accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
    view = document["bufferViews"][accessor["bufferView"]]
    data = np.frombuffer(binary, "<u2", 4 * accessor["count"], view["byteOffset"]).reshape(-1, 4) / 65535
    np.testing.assert_allclose(data[:, :3], np.tile([[0.02122, 0.00368, 0.57758]], (len(data), 1)), atol=2e-5)
    assert document["nodes"][0]["name"] == "hero"


def test_linear_light_has_the_standard_values():
    np.testing.assert_allclose(
        linear_from_srgb([0.0, 0.04045, 0.5, 1.0]), [0, 0.0031308, 0.2140411, 1], atol=1e-6
    )


def test_gltf_is_one_file_that_loads(tmp_path):
    path = save_mesh(_figure(), tmp_path / "hero.gltf")
    assert [p.name for p in tmp_path.iterdir()] == ["hero.gltf"]
    assert len(trimesh.load(path, force="mesh").faces) == 36


def test_bad_targets_are_named_and_leave_nothing(tmp_path):
    with pytest.raises(
        DataError, match=r"suffix '.fbx', expected one of .glb, .gltf, .obj, .ply, .stl, .usdz"
    ):
        save_mesh(_figure(), tmp_path / "hero.fbx")
    with pytest.raises(DataError, match="no folder"):
        save_mesh(_figure(), tmp_path / "no" / "hero.glb")
    with pytest.raises(DataError, match="without faces"):
        save_mesh(trimesh.Trimesh(), tmp_path / "hero.glb")
    broken = _figure()
    broken.vertices[0] = np.nan
    with pytest.raises(DataError, match="not finite"):
        save_mesh(broken, tmp_path / "hero.glb")
    assert not list(tmp_path.iterdir())


@pytest.mark.blender
def test_blender_opens_it_upright_facing_front_in_its_colors(tmp_path):
    bpy = pytest.importorskip("bpy", reason="needs the bpy module (pip install bpy)")
    path = save_mesh(_figure(), tmp_path / "hero.glb")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    (hero,) = [thing for thing in bpy.data.objects if thing.type == "MESH"]
    matrix = np.array(hero.matrix_world)
    points = np.array([v.co[:] for v in hero.data.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose([points.min(0), points.max(0)], [(-0.3, -0.5, 0), (0.9, 0.2, 2)], atol=1e-5)
    colors = np.array([c.color_srgb[:] for c in hero.data.color_attributes[0].data])
    np.testing.assert_allclose(255 * colors[:, :3], np.tile([[40, 12, 200]], (len(colors), 1)), atol=1.0)
