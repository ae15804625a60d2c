"""Base colours of materials that no picture says, baked into one by Cycles."""

from collections.abc import Mapping

import bpy
import numpy as np

from charnerf.blender.inside.looks import CUTOFF, Look
from charnerf.blender.inside.unlit import Source, base_color, connect

SIDE = 1024  # pixels of a baked picture
_SAMPLES = 4  # a texel
_UV_MAP = "charnerf"
_MARGIN = 8  # texels beyond an island's edge, so that its neighbours do not shine through


def bake(flat: bpy.types.Object, materials: Mapping[int, bpy.types.Material]) -> dict[int, Look]:
    """Bake materials of an object, by their slots.

    Args:
        flat: A mesh object; it gets a UV map of its own for the pictures.
        materials: Those to bake, each with a node tree.

    Returns:
        Their looks.
    """
    _prepare()
    _lay_out(flat, materials)
    sources = {slot: base_color(material) for slot, material in materials.items()}
    colors = _bake(flat, materials, {slot: color for slot, (color, _) in sources.items()})
    alphas = {slot: alpha for slot, (_, alpha) in sources.items() if alpha != (1.0,)}
    covers = _bake(flat, materials, alphas) if alphas else {}
    looks = {}
    for slot, image in colors.items():
        look = Look(image=image, uv=_UV_MAP, cutoff=CUTOFF if slot in covers else None)
        if slot in covers:
            _put_alpha(image, covers[slot])
        looks[slot] = look
    return looks


def _prepare() -> None:
    render = bpy.context.scene.render
    render.engine = "CYCLES"
    render.bake.margin, render.bake.use_clear, render.bake.target = _MARGIN, True, "IMAGE_TEXTURES"
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.film_exposure = _SAMPLES, 1.0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    if hasattr(cycles, "shading_system"):
        cycles.shading_system = False  # OSL runs what a file brings along


def _lay_out(flat: bpy.types.Object, slots: Mapping[int, bpy.types.Material]) -> None:
    """Unwrap the parts that are baked into a UV map of their own, every part over the whole picture."""
    _select(flat)
    mesh = flat.data
    rendered = next((each.name for each in mesh.uv_layers if each.active_render), None)
    made = mesh.uv_layers.new(name=_UV_MAP, do_init=False)
    if made is None:  # eight is the most
        mesh.uv_layers.remove(next(each for each in reversed(mesh.uv_layers) if each.name != rendered))
        made = mesh.uv_layers.new(name=_UV_MAP, do_init=False)
    mesh.uv_layers.active = mesh.uv_layers[_UV_MAP]
    part_of = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", part_of)
    for slot in slots:
        mesh.polygons.foreach_set("select", part_of == slot)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.uv.smart_project(island_margin=2.0 * _MARGIN / SIDE)
        bpy.ops.object.mode_set(mode="OBJECT")


def _bake(
    flat: bpy.types.Object, materials: Mapping[int, bpy.types.Material], wanted: Mapping[int, Source]
) -> dict[int, bpy.types.Image]:
    """Pictures of sources of materials, by their slots."""
    images, shown = {}, []
    for slot, holder in enumerate(flat.material_slots):
        is_wanted = slot in wanted
        tree = (materials[slot] if is_wanted else _fresh(holder)).node_tree
        side = SIDE if is_wanted else 1  # every material has to have a picture to bake into
        image = bpy.data.images.new(f"{_UV_MAP} {slot}", side, side, alpha=True, float_buffer=True)
        image.colorspace_settings.name = "Non-Color"
        target = tree.nodes.new("ShaderNodeTexImage")
        target.image = image
        tree.nodes.active = target
        if is_wanted:
            emission = tree.nodes.new("ShaderNodeEmission")
            connect(tree, wanted[slot], emission.inputs["Color"])
            output = next(
                each for each in tree.nodes if each.type == "OUTPUT_MATERIAL" and each.is_active_output
            )
            shown.append((tree, output.inputs["Surface"].links[0].from_socket, output.inputs["Surface"]))
            tree.links.new(emission.outputs[0], output.inputs["Surface"])
            images[slot] = image
    _select(flat)
    bpy.ops.object.bake(
        type="EMIT",
        target="IMAGE_TEXTURES",
        save_mode="INTERNAL",
        margin=_MARGIN,
        use_clear=True,
        uv_layer=_UV_MAP,
    )
    for tree, *link in shown:  # other objects may have the material too
        tree.links.new(*link)
    return images


def _fresh(holder: bpy.types.MaterialSlot) -> bpy.types.Material:
    """A material in the place of one that is not baked."""
    material = bpy.data.materials.new("charnerf unbaked")
    material.use_nodes = True
    holder.material = material
    return material


def _put_alpha(image: bpy.types.Image, cover: bpy.types.Image) -> None:
    values, alphas = np.zeros(SIDE * SIDE * 4, np.float32), np.zeros(SIDE * SIDE * 4, np.float32)
    image.pixels.foreach_get(values)
    cover.pixels.foreach_get(alphas)
    values[3::4] = alphas[0::4]
    image.pixels.foreach_set(values)


def _select(flat: bpy.types.Object) -> None:
    for each in bpy.context.scene.objects:
        each.select_set(each == flat)
    bpy.context.view_layer.objects.active = flat
