import json

import numpy as np
import pytest
import trimesh

from charnerf.capture.meshes import axes_rotation, load_scene
from charnerf.errors import ConfigError, DataError
from charnerf.surfaces.scene_mesh import surface_of_scene


def body(up, front):
    """A box 4 high, 2 wide, 1 deep, with a nose in front and its left half red, in a file's axes."""
    up, front = np.array(up, float), np.array(front, float)
    left = np.cross(up, front)
    frame = np.eye(4)
    frame[:3, :3] = np.stack((left, front, up), axis=1)
    trunk = trimesh.creation.box((2.0, 1.0, 4.0))
    nose = trimesh.creation.box((0.2, 0.2, 0.2)).apply_translation((0.5, 0.6, 1.0))
    mesh = trimesh.util.concatenate([trunk, nose])
    mesh.apply_transform(frame)
    return mesh.apply_translation((7.0, 8.0, 9.0))


Y_UP = ((0, 1, 0), (0, 0, 1))
Z_UP = ((0, 0, 1), (0, -1, 0))


@pytest.mark.parametrize(
    "suffix, axes, given",
    [
        ("glb", Y_UP, {}),
        ("gltf", Y_UP, {}),
        ("obj", Y_UP, {}),
        ("ply", Z_UP, {}),
        ("stl", Z_UP, {}),
        ("obj", Z_UP, {"up": "z"}),
        ("stl", Y_UP, {"up": "y"}),
        ("ply", ((0, 0, 1), (0, 1, 0)), {"facing": "+y"}),
        ("glb", ((0, 0, 1), (1, 0, 0)), {"up": "z", "facing": "+x"}),
        ("obj", ((0, 1, 0), (-1, 0, 0)), {"facing": "-x"}),
    ],
)
def test_every_format_comes_into_the_world_frame(tmp_path, suffix, axes, given):
    """2 m tall, on the floor, centred, nose towards -Y; its nose is on the character's left, +X."""
    file = tmp_path / f"body.{suffix}"
    if suffix == "gltf":
        for name, content in trimesh.Scene(body(*axes)).export(file_type="gltf").items():
            (tmp_path / name).write_bytes(content)
        file = tmp_path / "model.gltf"
    else:
        body(*axes).export(file)
    corners = surface_of_scene(load_scene(file, **given)).triangles.reshape(-1, 3)
    np.testing.assert_allclose(corners.min(axis=0), (-0.5, -0.3, 0.0), atol=1e-5)
    np.testing.assert_allclose(corners.max(axis=0), (0.5, 0.3, 2.0), atol=1e-5)
    nose = corners[corners[:, 1] < -0.29]
    np.testing.assert_allclose(nose.mean(axis=0)[[0, 2]], (0.25, 1.5), atol=1e-5)


def test_axes_are_rotations():
    for up, facing in (("y", "+z"), ("y", "-x"), ("z", "-y"), ("z", "+x")):
        rotation = axes_rotation(up, facing)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3))
        assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_array_equal(axes_rotation("z", "-y"), np.eye(3))


@pytest.mark.parametrize("up, facing", [("x", "+z"), ("y", "+y"), ("z", "y"), ("q", None), (None, "up")])
def test_wrong_axes_are_named(tmp_path, up, facing):
    body(*Y_UP).export(tmp_path / "body.obj")
    with pytest.raises(ConfigError, match="expected up y with facing one of"):
        load_scene(tmp_path / "body.obj", up, facing)


def test_dark_gltf_factors_keep_their_color(tmp_path):
    """Linear 0.004 has one step of 8 bits: 13 in sRGB, where it should be 11."""
    file = tmp_path / "dark.gltf"
    mesh = trimesh.creation.box()
    mesh.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(name="skin", baseColorFactor=(1, 1, 1, 255))
    )
    for name, content in trimesh.Scene(mesh).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    content = json.loads((tmp_path / "model.gltf").read_text())
    content["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [0.0035, 0.0041, 0.0044, 1.0]
    file.write_text(json.dumps(content))
    factor = surface_of_scene(load_scene(file)).materials[0].factor
    np.testing.assert_allclose(factor, (0.0035, 0.0041, 0.0044, 1.0), rtol=1e-6)


def test_ply_colors_are_srgb_and_glb_colors_linear(tmp_path):
    mesh = body(*Y_UP)
    mesh.visual.vertex_colors = (188, 188, 188, 255)
    mesh.export(tmp_path / "body.ply")
    mesh.export(tmp_path / "body.glb")
    ply = surface_of_scene(load_scene(tmp_path / "body.ply", up="y"))
    glb = surface_of_scene(load_scene(tmp_path / "body.glb"))
    assert ply.colors[0, 0, 0] * ply.materials[0].factor[0] == pytest.approx(0.5, abs=0.005)
    assert glb.colors[0, 0, 0] * glb.materials[0].factor[0] == pytest.approx(188 / 255, abs=1e-3)


def _write_points(file):
    trimesh.PointCloud(np.eye(3)).export(file)


def _write_nan(file):
    file.write_text("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n")


def _write_flat(file):
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n")


def _write_far_face(file):
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")


@pytest.mark.parametrize(
    "name, write, message",
    [
        ("a.obj", None, "no such file"),
        ("a.fbx", lambda file: file.write_text("x"), r"suffix '\.fbx', expected one of \.glb"),
        ("a.glb", lambda file: file.write_bytes(b"glTF nonsense"), "can not be read as a mesh"),
        ("a.stl", lambda file: file.write_bytes(b""), "a.stl"),
        ("a.obj", lambda file: file.write_text("v 0 0 0\nv 1 1 1\n"), "a.obj"),
        ("a.ply", _write_points, "found no faces"),
        ("a.obj", _write_nan, r"1 of 3 vertices not finite \(NaN or infinity\)"),
        ("a.obj", _write_flat, "found a height of 0 along its up axis"),
        ("a.obj", _write_far_face, "a.obj"),
    ],
)
def test_bad_meshes_are_named(tmp_path, name, write, message):
    if write:
        write(tmp_path / name)
    with pytest.raises(DataError, match=message) as caught:
        load_scene(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value)


def test_vertices_of_two_numbers_are_refused(tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n")
    with pytest.raises(DataError, match=r"flat\.obj: .*expected \(n, 3\)"):
        load_scene(tmp_path / "flat.obj")
