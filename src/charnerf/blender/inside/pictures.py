"""Pictures of a surface: base colours as light of their own, alpha, and depth."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from charnerf.surfaces.color import linear_from_bytes

_NEAREST = 65535  # of a 16-bit picture: Blender writes 1.0 there
_TINT = "tint"  # of corners; Cycles keeps the name `color` for itself
_EEVEE = ("BLENDER_EEVEE_NEXT", "BLENDER_EEVEE")  # its name from 4.2 to 4.5, and before and after


def take_pictures(job: dict[str, Any]) -> dict[str, Any]:
    """Render a surface from cameras.

    Args:
        job: surface, its .npz; cameras, a list of world_from_camera, focal (pixels, or pixels a metre), center, orthographic;
            size in pixels; engine; samples a pixel; constant, the share of light that is the same at any slant;
            depth, whether; folder to write 000.png and depth_000.png into; threads.

    Returns:
        engine: its name in this Blender.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    with np.load(job["surface"]) as arrays:
        shape = _build(dict(arrays), job["constant"])
    scene.collection.objects.link(shape)
    engine = _set_engine(scene, job)
    eye = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(eye)
    scene.camera = eye
    _set_colors(scene, encoded=True)
    _take(scene, eye, job, "")
    if job["depth"]:
        _show_depth(shape)
        _set_colors(scene, encoded=False)
        scene.cycles.samples, scene.cycles.filter_width = 1, 0.01  # the pixel's centre
        scene.render.engine = "CYCLES"
        _take(scene, eye, job, "depth_")
    return {"engine": engine}


def _take(scene: bpy.types.Scene, eye: bpy.types.Object, job: dict[str, Any], prefix: str) -> None:
    for index, camera in enumerate(job["cameras"]):
        _aim(eye, camera, job["size"])
        scene.render.filepath = str(Path(job["folder"]) / f"{prefix}{index:03d}.png")
        bpy.ops.render.render(write_still=True)


def _aim(eye: bpy.types.Object, camera: dict[str, Any], size: int) -> None:
    eye.matrix_world = np.array(camera["world_from_camera"]).T.tolist()  # columns
    lens, (x, y) = eye.data, camera["center"]
    lens.sensor_fit, lens.sensor_width = "HORIZONTAL", 36.0
    lens.clip_start, lens.clip_end = 0.01, 1000.0
    if camera["orthographic"]:
        lens.type, lens.ortho_scale = "ORTHO", size / camera["focal"]
    else:
        lens.type, lens.lens = "PERSP", camera["focal"] * lens.sensor_width / size
    lens.shift_x, lens.shift_y = 0.5 - x / size, y / size - 0.5


def _set_engine(scene: bpy.types.Scene, job: dict[str, Any]) -> str:
    render = scene.render
    render.resolution_x = render.resolution_y = job["size"]
    render.resolution_percentage = 100
    render.film_transparent, render.dither_intensity = True, 0.0
    render.use_persistent_data = True
    render.threads_mode, render.threads = "FIXED", job["threads"]
    cycles = scene.cycles
    cycles.samples, cycles.seed = job["samples"], 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.max_bounces, cycles.transparent_max_bounces = 0, 128
    if job["engine"] == "cycles":
        render.engine = "CYCLES"
    else:
        known = [each for each in _EEVEE if _has_engine(render, each)]
        render.engine, render.filter_size = known[0], 1.0
        scene.eevee.taa_render_samples = job["samples"]
    return render.engine


def _has_engine(render: bpy.types.RenderSettings, name: str) -> bool:
    try:
        render.engine = name
    except TypeError:
        return False
    return True


def _set_colors(scene: bpy.types.Scene, *, encoded: bool) -> None:
    """Pictures sRGB-encoded as they are (8 bits), or numbers as they are (16 bits)."""
    view = scene.view_settings
    view.view_transform, view.exposure, view.gamma = "Standard" if encoded else "Raw", 0.0, 1.0
    view.look, view.use_curve_mapping = "None", False
    file = scene.render.image_settings
    file.file_format, file.compression = "PNG", 15
    file.color_mode, file.color_depth = ("RGBA", "8") if encoded else ("BW", "16")


def _build(arrays: dict[str, np.ndarray], constant: float) -> bpy.types.Object:
    """The surface as one object."""
    triangles = arrays["triangles"].astype(np.float32)
    count = len(triangles)
    mesh = bpy.data.meshes.new("surface")
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", triangles.reshape(-1))
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(count, 3, np.int32))
    mesh.polygons.foreach_set("material_index", arrays["material_ids"].astype(np.int32))
    mesh.uv_layers.new(name="uv", do_init=False).data.foreach_set("uv", arrays["uvs"].reshape(-1))
    colors = mesh.color_attributes.new(_TINT, "FLOAT_COLOR", "CORNER")
    colors.data.foreach_set("color", arrays["colors"].reshape(-1))
    mesh.update(calc_edges=True)
    images = [
        _image(arrays[f"texture_{index}"])
        for index in range(sum(key.startswith("texture_") for key in arrays))
    ]
    for factor, cutoff, picture in zip(
        arrays["factors"], arrays["cutoffs"], arrays["picture_of"], strict=True
    ):
        image = images[picture] if picture >= 0 else None
        mesh.materials.append(_material(factor, None if np.isnan(cutoff) else float(cutoff), image, constant))
    return bpy.data.objects.new("surface", mesh)


def _image(pixels: np.ndarray) -> bpy.types.Image:
    """A picture in linear light: of bytes Cycles would mix neighbouring texels as they are encoded."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("texture", width, height, alpha=True, float_buffer=True)
    image.alpha_mode, image.colorspace_settings.name = "CHANNEL_PACKED", "Non-Color"
    linear = np.concatenate(
        (linear_from_bytes(pixels[..., :3]), pixels[..., 3:] / np.float32(255.0)), axis=-1
    )
    image.pixels.foreach_set(linear[::-1].astype(np.float32).reshape(-1))
    return image


def _material(
    factor: np.ndarray, cutoff: float | None, image: bpy.types.Image | None, constant: float
) -> bpy.types.Material:
    """Emission of factor times picture times corner colours; nothing where alpha is below the cutoff."""
    material = bpy.data.materials.new("part")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    corner = tree.nodes.new("ShaderNodeAttribute")
    corner.attribute_name = _TINT
    color, alpha = corner.outputs["Color"], corner.outputs["Alpha"]
    if image is not None:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        color = _vector(tree, "MULTIPLY", color, texture.outputs["Color"])
        alpha = _math(tree, "MULTIPLY", alpha, texture.outputs["Alpha"])
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(_vector(tree, "MULTIPLY", color, tuple(factor[:3])), emission.inputs["Color"])
    if constant < 1.0:
        tree.links.new(_slant(tree, constant), emission.inputs["Strength"])
    shader = emission.outputs[0]
    if cutoff is not None:
        mix = tree.nodes.new("ShaderNodeMixShader")
        is_there = _math(
            tree, "GREATER_THAN", _math(tree, "MULTIPLY", alpha, float(factor[3])), cutoff - 1e-6
        )
        tree.links.new(is_there, mix.inputs[0])
        tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
        tree.links.new(shader, mix.inputs[2])
        shader = mix.outputs[0]
    tree.links.new(shader, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def _slant(tree: bpy.types.NodeTree, constant: float) -> bpy.types.NodeSocket:
    """Light of a lamp at the camera and some from everywhere."""
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    facing = _vector(
        tree, "DOT_PRODUCT", geometry.outputs["True Normal"], geometry.outputs["Incoming"], "Value"
    )
    lamp = _math(tree, "MULTIPLY", _math(tree, "ABSOLUTE", facing, 0.0), 1.0 - constant)
    return _math(tree, "ADD", lamp, constant)


def _math(tree: bpy.types.NodeTree, operation: str, *values: Any) -> bpy.types.NodeSocket:
    return _node(tree, "ShaderNodeMath", operation, values).outputs[0]


def _vector(
    tree: bpy.types.NodeTree, operation: str, first: Any, second: Any, output: str = "Vector"
) -> bpy.types.NodeSocket:
    return _node(tree, "ShaderNodeVectorMath", operation, (first, second)).outputs[output]


def _node(tree: bpy.types.NodeTree, kind: str, operation: str, values: tuple[Any, ...]) -> bpy.types.Node:
    node = tree.nodes.new(kind)
    node.operation = operation
    for socket, value in zip(node.inputs, values, strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def _show_depth(shape: bpy.types.Object) -> None:
    """Let every material shine by its distance along the camera's axis, in units of a 16-bit picture of mm."""
    for material in shape.data.materials:
        tree = material.node_tree
        emission = next(node for node in tree.nodes if node.type == "EMISSION")
        distance = tree.nodes.new("ShaderNodeCameraData").outputs["View Z Depth"]
        tree.links.new(_math(tree, "MULTIPLY", distance, 1000.0 / _NEAREST), emission.inputs["Color"])
        for link in emission.inputs["Strength"].links:
            tree.links.remove(link)
        emission.inputs["Strength"].default_value = 1.0
