"""Parts: named closed shapes with a colour or a texture, and how they become one textured scene."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from charnerf.geometry.world import HEIGHT
from charnerf.procedural.shapes import Shape

Texels = NDArray[np.uint8]
BORDER = 2  # texels repeated around every texture, so that neighbours never bleed into each other
SWATCH = 4  # side of a flat colour's patch, texels; every texture begins at a multiple of it


@dataclass(frozen=True)
class Part:
    """A named shape with its paint: texels (rows, columns, 3) sRGB; a flat colour is a single texel."""

    name: str
    shape: Shape
    texels: Texels


Painted = list[tuple[Shape, ArrayLike]]  # shapes, each of one sRGB colour


def flat(name: str, shape: Shape, color: ArrayLike) -> Part:
    """A part of one sRGB colour."""
    texel = (np.clip(np.asarray(color, dtype=np.float64), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return Part(name, shape, texel.reshape(1, 1, 3))


def pixelated(part: Part, cell: int) -> Part:
    """The part with its texture in coarse squares of cell texels."""
    rows, columns = part.texels.shape[:2]
    if min(rows, columns) < 2 * cell:
        return part
    row, column = np.arange(rows) // cell * cell + cell // 2, np.arange(columns) // cell * cell + cell // 2
    return Part(
        part.name, part.shape, part.texels[np.minimum(row, rows - 1)][:, np.minimum(column, columns - 1)]
    )


def _padded(texels: Texels) -> Texels:
    if texels.shape[:2] == (1, 1):
        return np.repeat(np.repeat(texels, SWATCH, axis=0), SWATCH, axis=1)
    rows, columns = texels.shape[:2]
    more = (-(rows + 2 * BORDER) % SWATCH, -(columns + 2 * BORDER) % SWATCH)  # whole blocks of coarser levels
    return np.pad(texels, ((BORDER, BORDER + more[0]), (BORDER, BORDER + more[1]), (0, 0)), mode="edge")


def _pack(images: list[Texels]) -> tuple[Texels, list[tuple[int, int]]]:
    """Shelves of images, the tallest first: the atlas and each image's top-left corner (row, column)."""
    area = sum(image.shape[0] * image.shape[1] for image in images)
    width = max(64, *(image.shape[1] for image in images), int(np.ceil(1.1 * np.sqrt(area) / 16.0)) * 16)
    corners = [(0, 0)] * len(images)
    row = column = shelf = 0
    for index in sorted(range(len(images)), key=lambda i: (-images[i].shape[0], i)):
        height, length = images[index].shape[:2]
        if column + length > width:
            row, column, shelf = row + shelf, 0, 0
        corners[index] = (row, column)
        column, shelf = column + length, max(shelf, height)
    atlas = np.zeros((row + shelf, width, 3), dtype=np.uint8)
    for image, (top, left) in zip(images, corners, strict=True):
        atlas[top : top + image.shape[0], left : left + image.shape[1]] = image
    return atlas, corners


def _atlas_uv(part: Part, corner: tuple[int, int], atlas_shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Texture coordinates (f, 3, 2) of a part in the atlas, v upwards."""
    rows, columns = part.texels.shape[:2]
    if (rows, columns) == (1, 1):
        x = np.full(part.shape.uv.shape[:2], corner[1] + 0.5 * SWATCH)
        y = np.full(part.shape.uv.shape[:2], corner[0] + 0.5 * SWATCH)
    else:
        u, v = np.clip(part.shape.uv[..., 0], 0.0, 1.0), np.clip(part.shape.uv[..., 1], 0.0, 1.0)
        x = corner[1] + BORDER + u * columns
        y = corner[0] + BORDER + (1.0 - v) * rows
    return np.stack((x / atlas_shape[1], 1.0 - y / atlas_shape[0]), axis=-1)


def _split_seams(shape: Shape, uv: NDArray[np.float64]) -> tuple[NDArray, NDArray, NDArray]:
    """One vertex for each distinct (vertex, texture coordinate): vertices, faces, uv per vertex."""
    steps = np.round(uv.reshape(-1, 2) * 2.0**20).astype(np.int64)
    key = (shape.faces.reshape(-1) << 42) + (steps[:, 0] << 21) + steps[:, 1]
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    vertices = shape.vertices[shape.faces.reshape(-1)[first]]
    return vertices, inverse.reshape(-1, 3), uv.reshape(-1, 2)[first]


def assemble(parts: list[Part]) -> trimesh.Scene:
    """One scene: parts of one name become one geometry; all share one material and its texture."""
    paints: dict[bytes, int] = {}
    images: list[Texels] = []
    slots = []
    for part in parts:
        key = part.texels.tobytes() + str(part.texels.shape).encode()
        if key not in paints:
            paints[key] = len(images)
            images.append(_padded(part.texels))
        slots.append(paints[key])
    atlas, corners = _pack(images)
    material = trimesh.visual.material.PBRMaterial(
        name="character", baseColorTexture=Image.fromarray(atlas), metallicFactor=0.0, roughnessFactor=1.0
    )
    groups: dict[str, list[tuple[NDArray, NDArray, NDArray]]] = {}
    for part, slot in zip(parts, slots, strict=True):
        uv = _atlas_uv(part, corners[slot], atlas.shape)
        groups.setdefault(part.name, []).append(_split_seams(part.shape, uv))
    scene = trimesh.Scene()
    for name, pieces in groups.items():
        offsets = np.cumsum([0, *(len(vertices) for vertices, _, _ in pieces[:-1])])
        mesh = trimesh.Trimesh(
            vertices=np.concatenate([vertices for vertices, _, _ in pieces]),
            faces=np.concatenate(
                [faces + offset for (_, faces, _), offset in zip(pieces, offsets, strict=True)]
            ),
            visual=trimesh.visual.TextureVisuals(
                uv=np.concatenate([uv for _, _, uv in pieces]), material=material
            ),
            process=False,
        )
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    return scene


def to_world(parts: list[Part]) -> list[Part]:
    """Scale to the world's height with the feet on z = 0 and the bounding box centred on the z axis."""
    points = np.concatenate([part.shape.vertices for part in parts])
    low, high = points.min(axis=0), points.max(axis=0)
    scale = HEIGHT / (high[2] - low[2])
    middle = np.array((0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]))
    world = []
    for part in parts:
        vertices = (part.shape.vertices - middle) * scale
        vertices[:, 2] = np.clip(vertices[:, 2], 0.0, HEIGHT)
        world.append(Part(part.name, Shape(vertices, part.shape.faces, part.shape.uv), part.texels))
    return world
