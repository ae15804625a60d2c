"""Makes the files of tests/blender, inside Blender: `python blender_files.py FOLDER`.

The figure is 2 m of boxes: legs in a flat colour, a body with a picture, a head with vertex colours, arms out. Colours are kept
apart from sRGB's ends so that errors show.
"""

import json
import struct
import sys
import wave
from math import radians
from pathlib import Path

import bpy
import numpy as np

BOXES = {  # centre, size, m
    "legs": ((0.0, 0.0, 0.4), (0.4, 0.3, 0.8)),
    "body": ((0.0, 0.0, 1.15), (0.6, 0.35, 0.7)),
    "head": ((0.1, 0.0, 1.75), (0.3, 0.3, 0.5)),
}
LEGS = (0.6, 0.1, 0.05)  # linear
PICTURE = 32  # pixels a side


def make_picture(name: str, alpha: bool = False) -> bpy.types.Image:
    """A smooth picture, packed; with alpha its right half is clear."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, PICTURE), np.linspace(0.0, 1.0, PICTURE))
    pixels = np.stack((0.2 + 0.6 * x, 0.3 + 0.4 * y, 0.6 - 0.3 * x, np.ones_like(x)), axis=-1)
    if alpha:
        pixels[:, PICTURE // 2 :, 3] = 0.0
    image = bpy.data.images.new(name, PICTURE, PICTURE, alpha=alpha)
    image.pixels.foreach_set(pixels.astype(np.float32).reshape(-1))
    image.pack()
    return image


def new_material(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    """A material with one principled shader."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    return material, next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def pictured(name: str, image: bpy.types.Image) -> bpy.types.Material:
    """A material with a picture for its base colour."""
    material, shader = new_material(name)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material


def add_box(name: str, centre, size, material: bpy.types.Material | None) -> bpy.types.Object:
    """A box with a UV map, laid on from the front."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.name = name
    for vertex in box.data.vertices:
        vertex.co = [c + s * float(x) for c, s, x in zip(centre, size, vertex.co, strict=True)]
    layer = box.data.uv_layers[0]
    low = np.array(centre) - 0.5 * np.array(size)
    for loop in box.data.loops:
        at = (np.array(box.data.vertices[loop.vertex_index].co) - low) / size
        layer.data[loop.index].uv = (0.05 + 0.9 * at[0], 0.05 + 0.9 * at[2])
    if material is not None:
        box.data.materials.append(material)
    return box


def make_figure(prefix: str = "", aside: float = 0.0) -> bpy.types.Object:
    """The figure on an armature `Hero`, whose action `Bow` turns the upper half forwards by 60 degrees in 20 frames."""
    legs, shader = new_material(f"{prefix}legs")
    shader.inputs["Base Color"].default_value = (*LEGS, 1.0)
    materials = {
        "legs": legs,
        "body": pictured(f"{prefix}cloth", make_picture(f"{prefix}cloth")),
        "head": pictured(f"{prefix}skin", make_picture(f"{prefix}skin")),
    }
    bones = bpy.data.armatures.new(f"{prefix}rig")
    hero = bpy.data.objects.new(f"{prefix}Hero", bones)
    bpy.context.scene.collection.objects.link(hero)
    bpy.context.view_layer.objects.active = hero
    bpy.ops.object.mode_set(mode="EDIT")
    low, up = bones.edit_bones.new("low"), bones.edit_bones.new("up")
    low.head, low.tail, up.head, up.tail = (0, 0, 0), (0, 0, 0.8), (0, 0, 0.8), (0, 0, 2)
    up.parent = low
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, (centre, size) in BOXES.items():
        box = add_box(prefix + name, centre, size, materials[name])
        box.parent = hero
        box.vertex_groups.new(name="low" if name == "legs" else "up").add(range(8), 1.0, "REPLACE")
        box.modifiers.new("rig", "ARMATURE").object = hero
    bend = hero.pose.bones["up"]
    bend.rotation_mode = "XYZ"
    for frame, degrees in ((1, 0.0), (20, 60.0)):
        bend.rotation_euler = (radians(degrees), 0.0, 0.0)
        bend.keyframe_insert("rotation_euler", frame=frame)
    hero.animation_data.action.name = f"{prefix}Bow"
    hero.location.x = aside
    bpy.context.scene.frame_set(12)
    return hero


def save(file: Path) -> None:
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(file), compress=False)


def make_vrm(glb: Path, file: Path, version: str) -> None:
    """A GLB that says that it is a VRM."""
    content = glb.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    tree = json.loads(content[20 : 20 + length])
    extension = {"1": "VRMC_vrm", "0": "VRM"}[version]
    tree["extensions"] = {extension: {"specVersion": f"{version}.0"}}
    tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), extension]
    head = json.dumps(tree).encode()
    head += b" " * (-len(head) % 4)
    body = struct.pack("<II", len(head), 0x4E4F534A) + head + content[20 + length :]
    file.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


def make_formats(folder: Path) -> None:
    """One figure in every format."""
    make_figure()
    save(folder / "blend.blend")
    bpy.ops.export_scene.fbx(
        filepath=str(folder / "fbx.fbx"), path_mode="COPY", embed_textures=True, add_leaf_bones=False
    )
    bpy.context.scene.frame_set(1)
    bpy.ops.export_scene.gltf(filepath=str(folder / "glb.glb"), export_format="GLB")
    make_vrm(folder / "glb.glb", folder / "vrm1.vrm", "1")
    make_vrm(folder / "glb.glb", folder / "vrm0.vrm", "0")


def make_two(folder: Path) -> None:
    """Two figures in one file, and a lamp post that does not render."""
    make_figure("anna_", -1.0)
    make_figure("ben_", 1.0).scale = (0.5, 0.5, 0.5)
    add_box("post", (0.0, 3.0, 2.0), (0.2, 0.2, 4.0), None).hide_render = True
    save(folder / "two.blend")


def make_evil(folder: Path) -> None:
    """Files that would write `ran-*`, or that need what lies elsewhere."""
    make_figure()
    text = bpy.data.texts.new("evil.py")
    text.write(f"open({str(folder / 'ran-text')!r}, 'w').close()")
    text.use_module = True
    driver = bpy.data.objects["head"].driver_add("location", 0).driver
    driver.type = "SCRIPTED"
    driver.expression = f"open({str(folder / 'ran-driver')!r}, 'w').close() or 0.0"
    save(folder / "evil.blend")
    (folder / "own").mkdir()
    outside = folder / "outside.png"
    image = bpy.data.images["cloth"]
    image.filepath_raw, image.file_format = str(outside), "PNG"
    image.save()
    image.unpack(method="REMOVE")
    save(folder / "own" / "picture.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with wave.open(str(folder / "outside.wav"), "wb") as sound:
        sound.setparams((1, 1, 8000, 1, "NONE", ""))
        sound.writeframes(b"0")
    make_figure()
    bpy.data.sounds.load(str(folder / "outside.wav")).use_fake_user = True
    save(folder / "own" / "sound.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(folder / "two.blend"), link=True) as (there, taken):
        taken.objects = list(there.objects)
    for each in taken.objects:
        bpy.context.scene.collection.objects.link(each)
    save(folder / "own" / "linked.blend")


def make_materials(folder: Path) -> None:
    """Boxes side by side, 0.3 m apart, each with a material that a picture alone does not say; two share the last."""
    mixed, shader = new_material("mixed")
    mix = mixed.node_tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    factor, first, second = (each for each in mix.inputs if each.enabled)
    factor.default_value, first.default_value, second.default_value = (
        0.25,
        (0.8, 0.2, 0.1, 1),
        (0.0, 0.6, 0.9, 1),
    )
    mixed.node_tree.links.new(next(each for each in mix.outputs if each.enabled), shader.inputs["Base Color"])

    shaders, shader = new_material("shaders")
    tree = shaders.node_tree
    shader.inputs["Base Color"].default_value = (0.5, 0.4, 0.1, 1.0)
    glow, both = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeMixShader")
    glow.inputs["Color"].default_value, both.inputs[0].default_value = (0.1, 0.4, 0.9, 1.0), 0.5
    tree.links.new(shader.outputs[0], both.inputs[1])
    tree.links.new(glow.outputs[0], both.inputs[2])
    tree.links.new(
        both.outputs[0], next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL").inputs[0]
    )

    painted, shader = new_material("painted")
    tree = painted.node_tree
    paint, times = tree.nodes.new("ShaderNodeVertexColor"), tree.nodes.new("ShaderNodeMix")
    paint.layer_name, times.data_type, times.blend_type = "paint", "RGBA", "MULTIPLY"
    factor, first, second = (each for each in times.inputs if each.enabled)
    factor.default_value, second.default_value = 1.0, (0.5, 1.0, 1.0, 1.0)
    tree.links.new(paint.outputs["Color"], first)
    tree.links.new(next(each for each in times.outputs if each.enabled), shader.inputs["Base Color"])

    moved, shader = new_material("moved")
    tree = moved.node_tree
    image, mapping, uv = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Mapping", "UVMap"))
    image.image, uv.uv_map = make_picture("cloth", alpha=True), "second"
    mapping.inputs["Location"].default_value = (0.25, 0.0, 0.0)
    tree.links.new(uv.outputs[0], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(image.outputs["Alpha"], shader.inputs["Alpha"])

    veil, shader = new_material("veil")
    add = veil.node_tree.nodes.new("ShaderNodeMath")
    add.inputs[0].default_value, add.inputs[1].default_value = 0.1, 0.2
    shader.inputs["Base Color"].default_value = (0.2, 0.2, 0.2, 1.0)
    veil.node_tree.links.new(add.outputs[0], shader.inputs["Alpha"])

    for index, material in enumerate((mixed, shaders, painted, moved, veil, veil)):
        box = add_box(material.name, (0.3 * index, 0.0, 1.0), (0.2, 0.2, 2.0), material)
        box.data.color_attributes.new("paint", "FLOAT_COLOR", "CORNER").data.foreach_set(
            "color", np.tile(np.array((0.8, 0.3, 0.2, 1.0), np.float32), 24)
        )
        second = box.data.uv_layers.new(name="second")
        second.data.foreach_set("uv", np.tile(np.array((0.1, 0.5), np.float32), 24))
    save(folder / "materials.blend")


def make_kinds(folder: Path) -> None:
    """A box that is only there as a collection's instance, and a hoop that is a curve."""
    box = add_box("box", (0.0, 0.0, 1.0), (0.2, 0.2, 2.0), None)
    group = bpy.data.collections.new("group")
    group.objects.link(box)
    bpy.context.scene.collection.objects.unlink(box)
    placed = bpy.data.objects.new("placed", None)
    placed.instance_type, placed.instance_collection, placed.location = "COLLECTION", group, (0.5, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(placed)
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.2, location=(0.0, 0.0, 1.0))
    bpy.context.object.name, bpy.context.object.data.bevel_depth = "hoop", 0.05
    save(folder / "kinds.blend")


def main(folder: Path) -> None:
    for make in (make_formats, make_two, make_evil, make_materials, make_kinds):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        make(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
