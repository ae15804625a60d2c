"""A character's file to triangles with base colours."""

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from charnerf.blender.inside.baking import SIDE, bake
from charnerf.blender.inside.characters import choose
from charnerf.blender.inside.flattening import flatten
from charnerf.blender.inside.looks import Look, NotPlain, pixels_of, plain_look
from charnerf.blender.inside.opening import check_pictures, open_file
from charnerf.blender.inside.poses import set_pose
from charnerf.blender.inside.refusal import Refused
from charnerf.blender.inside.unlit import base_color


def read_character(job: dict[str, Any]) -> dict[str, Any]:
    """Read a file in a pose and write its surface.

    Args:
        job: file; action and frame; objects, names; most_pixels of pictures; surface, the .npz to write.

    Returns:
        notes: what is to be said about it.

    Raises:
        Refused: If it can not be had.
    """
    file = Path(job["file"])
    notes = open_file(file)
    set_pose(job["action"], job["frame"])
    flats = flatten(choose(job["objects"]))
    if not flats:
        raise Refused("has no faces to capture; point clouds and lines can not be")
    materials = {each.material for flat in flats for each in flat.material_slots if each.material}
    left = job["most_pixels"]
    for material in sorted(materials, key=lambda each: each.name):
        check_pictures(material, file.parent, left)
    textures: dict[str, np.ndarray] = {}
    parts = []
    for flat in flats:
        looks = _looks(flat, notes)
        for slot, look in looks.items():
            part = _part(flat, slot, look)
            if part is not None:
                parts.append((look, *part))
    _write(Path(job["surface"]), parts, textures)
    return {"notes": notes}


def _looks(flat: bpy.types.Object, notes: list[str]) -> dict[int, Look]:
    """Looks of an object's slots; one without materials has slot 0."""
    looks: dict[int, Look] = {}
    to_bake: dict[int, bpy.types.Material] = {}
    for slot, holder in enumerate(flat.material_slots):
        material = holder.material
        if material is None:
            looks[slot] = Look(factor=(0.4, 0.4, 0.4, 1.0))
        elif not material.use_nodes:
            looks[slot] = Look(factor=(*material.diffuse_color[:3], 1.0))
        else:
            try:
                looks[slot] = plain_look(*base_color(material))
            except NotPlain as why:
                to_bake[slot] = material
                note = f"material {material.name!r} is baked to {SIDE} x {SIDE} pixels for {why}"
                notes += [] if note in notes else [note]
    if not flat.material_slots:
        attribute = next(iter(flat.data.color_attributes), None)
        looks[0] = Look(attribute=attribute.name) if attribute else Look(factor=(0.4, 0.4, 0.4, 1.0))
    return looks | (bake(flat, to_bake) if to_bake else {})


def _part(flat: bpy.types.Object, slot: int, look: Look) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Corners (M, 3, 3) in the scene, UVs (M, 3, 2) and colours (M, 3, 4) of the triangles of a slot."""
    mesh = flat.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    loops, part_of = np.zeros(3 * count, np.int32), np.zeros(count, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("material_index", part_of)
    last = max(len(flat.material_slots) - 1, 0)
    corners = loops.reshape(-1, 3)[np.minimum(part_of, last) == slot]
    if not len(corners):
        return None
    vertex_of = np.zeros(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex_of)
    points = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    matrix = np.array(flat.matrix_world, np.float64)
    placed = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        corners = corners[:, ::-1]  # keeps the outside outside
    return placed[vertex_of[corners]], _uvs(mesh, look)[corners], _colors(mesh, look, vertex_of)[corners]


def _uvs(mesh: bpy.types.Mesh, look: Look) -> np.ndarray:
    """Texture coordinates of a look at all corners (loops, 2); zero where the mesh has no such map."""
    layer = mesh.uv_layers.get(look.uv) or next((each for each in mesh.uv_layers if each.active_render), None)
    if layer is None or look.image is None:
        return np.zeros((len(mesh.loops), 2))
    flat = np.zeros(2 * len(mesh.loops), np.float32)
    layer.data.foreach_get("uv", flat)
    return flat.reshape(-1, 2) @ look.affine[:, :2].T + look.affine[:, 2]


def _colors(mesh: bpy.types.Mesh, look: Look, vertex_of: np.ndarray) -> np.ndarray:
    """Linear colours of a look's attribute at all corners (loops, 4); one without."""
    colors = np.ones((len(mesh.loops), 4), np.float32)
    if look.attribute is None:
        return colors
    attributes = mesh.color_attributes
    index = attributes.find(look.attribute) if look.attribute else attributes.render_color_index
    if not 0 <= index < len(attributes):
        return colors * (0.0, 0.0, 0.0, 1.0)  # as Blender shows what is not there
    attribute = attributes[index]
    flat = np.zeros(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get("color", flat)
    values = flat.reshape(-1, 4)
    colors[:, :3] = (values if attribute.domain == "CORNER" else values[vertex_of])[:, :3]
    return colors


def _write(file: Path, parts: list[tuple[Any, ...]], textures: dict[str, np.ndarray]) -> None:
    """Write parts, each a material of its own, as `charnerf.blender.surface_file` reads them."""
    names: list[str] = []
    for look, *_ in parts:
        if look.image is not None and look.image.name not in textures:
            textures[look.image.name] = pixels_of(look.image)
    names = list(textures)
    looks = [look for look, *_ in parts]
    pictures: dict[str, Any] = {f"texture_{index}": textures[name] for index, name in enumerate(names)}
    np.savez(
        file,
        triangles=np.concatenate([part[1] for part in parts]),
        uvs=np.concatenate([part[2] for part in parts]).astype(np.float32),
        colors=np.concatenate([part[3] for part in parts]).astype(np.float32),
        material_ids=np.repeat(np.arange(len(parts), dtype=np.int32), [len(part[1]) for part in parts]),
        factors=np.array([look.factor for look in looks], np.float32),
        cutoffs=np.array([np.nan if look.cutoff is None else look.cutoff for look in looks]),
        picture_of=np.array([-1 if look.image is None else names.index(look.image.name) for look in looks]),
        **pictures,
    )
