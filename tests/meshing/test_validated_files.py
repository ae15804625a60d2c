"""Files as other programs see them: the Khronos validator (where node has it), Blender (opt in), Pixar's USD."""

import json
import os
import shutil
import subprocess

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from charnerf.meshing.atlas import rasterise, unwrap
from charnerf.meshing.export import save_mesh
from charnerf.meshing.texture import padded_picture, textured_copy

SIDES = {"front": (200, 40, 30), "left": (40, 160, 60), "back": (30, 70, 220), "right": (128, 128, 128)}
VALIDATE = """
const validator = require('gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
validator.validateBytes(bytes).then((report) => console.log(JSON.stringify(report.issues)));
"""


def _box() -> trimesh.Trimesh:
    """2 m tall on the floor, nose towards -Y, so that each program's front can be told."""
    body = trimesh.creation.box(bounds=[(-0.4, -0.3, 0.0), (0.4, 0.3, 2.0)])
    nose = trimesh.creation.box(bounds=[(-0.05, -0.5, 1.7), (0.05, -0.3, 1.8)])
    box = trimesh.util.concatenate([body, nose])
    box.unmerge_vertices()  # faces of their own normals
    return trimesh.Trimesh(box.vertices, box.faces, process=False)


def _side_colors(normals: np.ndarray) -> np.ndarray:
    """Colour by where a normal points (n, 3); sides by name, top and bottom grey."""
    colors = np.tile(np.array(SIDES["right"], np.float64), (len(normals), 1))
    for name, axis in (("front", (0, -1, 0)), ("left", (1, 0, 0)), ("back", (0, 1, 0))):
        colors[normals @ np.array(axis) > 0.5] = SIDES[name]
    return colors / 255.0


def _textured() -> trimesh.Trimesh:
    mesh = _box()
    atlas = unwrap(mesh, 128)
    texels = rasterise(atlas, 128)
    rgb = _side_colors(mesh.face_normals[texels.face])
    return textured_copy(mesh, atlas, Image.fromarray(padded_picture(rgb, texels, 128)))


def _colored() -> trimesh.Trimesh:
    mesh = _box()
    rgba = np.full((len(mesh.vertices), 4), 255, np.uint8)
    rgba[:, :3] = np.round(255 * _side_colors(mesh.vertex_normals))
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=rgba)
    return mesh


MESHES = {"textured": _textured, "coloured": _colored, "plain": _box}


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_the_khronos_validator_finds_nothing(tmp_path, kind, suffix):
    """Set NODE_PATH to a folder with the npm package gltf-validator."""
    node = shutil.which("node")
    if node is None or not os.environ.get("NODE_PATH"):
        pytest.skip("needs node, and NODE_PATH with the npm package gltf-validator")
    path = save_mesh(MESHES[kind](), tmp_path / f"hero.{suffix}")
    done = subprocess.run([node, "-e", VALIDATE, str(path)], capture_output=True, text=True, check=False)
    if "Cannot find module" in done.stderr:
        pytest.skip("NODE_PATH has no gltf-validator")
    issues = json.loads(done.stdout)
    assert (issues["numErrors"], issues["numWarnings"], issues["numInfos"]) == (0, 0, 0), issues["messages"]


def test_glb_and_obj_give_the_texture_back(tmp_path):
    mesh = _textured()
    for suffix in (".glb", ".obj"):
        loaded = trimesh.load(save_mesh(mesh, tmp_path / f"hero{suffix}"), force="mesh", process=False)
        material = loaded.visual.material
        picture = material.baseColorTexture if suffix == ".glb" else material.image
        assert (np.asarray(picture.convert("RGB")) == np.asarray(mesh.visual.material.baseColorTexture)).all()
        np.testing.assert_allclose(loaded.bounds, [(-0.4, 0.0, -0.3), (0.4, 2.0, 0.5)], atol=1e-6)
        uv = loaded.visual.uv[loaded.faces] if suffix == ".obj" else np.asarray(loaded.visual.uv)
        wanted = mesh.visual.uv[mesh.faces] if suffix == ".obj" else np.asarray(mesh.visual.uv)
        np.testing.assert_allclose(uv, wanted, atol=1e-6)


def test_ply_gets_the_textures_colors_at_the_corners(tmp_path):
    loaded = trimesh.load(save_mesh(_textured(), tmp_path / "hero.ply"), force="mesh", process=False)
    wanted = 255 * _side_colors(loaded.vertex_normals)
    assert np.abs(loaded.visual.vertex_colors[:, :3] - wanted).max() <= 3


@pytest.mark.parametrize("kind", MESHES)
def test_usdz_is_a_metric_package_y_up_with_its_picture(tmp_path, kind):
    usd = pytest.importorskip("pxr.Usd", reason="needs usd-core (extra `usd`)")
    from pxr import UsdGeom, UsdShade

    stage = usd.Stage.Open(str(save_mesh(MESHES[kind](), tmp_path / "hero.usdz")))
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Character/Mesh"))
    points = np.array(mesh.GetPointsAttr().Get())
    np.testing.assert_allclose([points.min(0), points.max(0)], [(-0.4, 0, -0.3), (0.4, 2, 0.5)], atol=1e-6)
    assert stage.GetDefaultPrim().GetDisplayName() == "hero"
    assert UsdShade.MaterialBindingAPI(mesh).GetDirectBinding().GetMaterial()
    assert bool(stage.GetPrimAtPath("/Character/Material/Picture")) == (kind == "textured")


def test_without_the_library_usdz_says_what_to_install(tmp_path, monkeypatch):
    from charnerf.errors import DependencyError

    monkeypatch.setitem(__import__("sys").modules, "pxr", None)
    with pytest.raises(DependencyError, match=r"pip install 'charnerf\[usd\]'"):
        save_mesh(_box(), tmp_path / "hero.usdz")
    assert not list(tmp_path.iterdir())


@pytest.mark.blender
@pytest.mark.parametrize("suffix", ["glb", "gltf", "obj", "usdz"])
def test_blender_shows_each_side_in_its_color(tmp_path, suffix):
    """Imported 2 m tall, facing -Y; an unlit render has the sRGB colours that were written."""
    bpy = pytest.importorskip("bpy", reason="needs the bpy module (pip install bpy)")
    path = save_mesh(_textured(), tmp_path / f"hero.{suffix}")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    importers = {"obj": bpy.ops.wm.obj_import, "usdz": bpy.ops.wm.usd_import}
    importers.get(suffix, bpy.ops.import_scene.gltf)(filepath=str(path))
    (hero,) = [thing for thing in bpy.data.objects if thing.type == "MESH"]
    matrix = np.array(hero.matrix_world)
    points = np.array([v.co[:] for v in hero.data.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose([points.min(0), points.max(0)], [(-0.4, -0.5, 0), (0.4, 0.3, 2)], atol=1e-4)
    _make_unlit(bpy, hero)
    for name, place in (("front", (0, -5, 1)), ("left", (5, 0, 1)), ("back", (0, 5, 1))):
        pixel = _seen_from(bpy, place, tmp_path / f"{name}.png")
        assert np.abs(pixel - SIDES[name]).max() <= 3.0, (name, pixel)


def _make_unlit(bpy, hero) -> None:
    """Connect each material's picture to its output by way of an emission."""
    for material in hero.data.materials:
        nodes, links = material.node_tree.nodes, material.node_tree.links
        (picture,) = [node for node in nodes if node.type == "TEX_IMAGE"]
        output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
        emission = nodes.new("ShaderNodeEmission")
        links.new(picture.outputs["Color"], emission.inputs["Color"])
        links.new(emission.outputs[0], output.inputs["Surface"])


def _seen_from(bpy, place, file) -> np.ndarray:
    """sRGB bytes (3,) in the middle of a small picture of a camera at a place that looks at (0, 0, 1)."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
    scene.render.dither_intensity = 0.0
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.filepath, scene.render.image_settings.file_format = str(file), "PNG"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location = place
    from mathutils import Vector

    camera.rotation_euler = (Vector((0, 0, 1)) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    scene.camera = camera
    bpy.ops.render.render(write_still=True)
    pixels = torch.from_numpy(np.asarray(Image.open(file).convert("RGB")).copy()).double()
    return pixels[7:9, 7:9].mean((0, 1)).numpy()
