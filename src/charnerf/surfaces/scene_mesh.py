"""From a trimesh scene to a SurfaceMesh: which colours mean what.

Colours are taken as glTF means them: textures sRGB, factors and vertex or face colours linear. A geometry whose metadata
holds COLORS_KEY = "srgb" has vertex or face colours that are sRGB-encoded (PLY, OBJ, STL). The diffuse colour of a
SimpleMaterial (MTL's Kd) is sRGB and gives way to its texture, as the programs that write such files mean it.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual.color import ColorVisuals
from trimesh.visual.material import MultiMaterial, PBRMaterial, SimpleMaterial
from trimesh.visual.texture import TextureVisuals

from charnerf.errors import DataError
from charnerf.surfaces.color import linear_from_srgb
from charnerf.surfaces.surface_mesh import CUTOFF, SurfaceMaterial, SurfaceMesh, Texture, make_texture

COLORS_KEY = "charnerf_colors"
FACTOR_KEY = "charnerf_base_color_factor"  # exact; trimesh keeps 8 bits of it, too few for dark colours
_UNKNOWN = np.array((0.4, 0.4, 0.4, 1.0), np.float32)  # linear; where a file says nothing of colours


@dataclass(frozen=True)
class _Part:
    """Triangles of one material: corners (M, 3, 3), uvs (M, 3, 2), colours (M, 3, 4)."""

    triangles: np.ndarray
    uvs: np.ndarray
    colors: np.ndarray
    material: SurfaceMaterial


def placed_meshes(
    scene: trimesh.Scene | trimesh.Trimesh,
) -> list[tuple[trimesh.Trimesh, np.ndarray, np.ndarray]]:
    """Every triangle mesh of a scene, its vertices (n, 3) in the scene's frame, and its faces (M, 3)."""
    if isinstance(scene, trimesh.Trimesh):
        return [(scene, np.asarray(scene.vertices, dtype=np.float64), np.asarray(scene.faces))]
    placed = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            continue
        vertices = np.asarray(mesh.vertices, dtype=np.float64) @ transform[:3, :3].T + transform[:3, 3]
        placed.append((mesh, vertices, np.asarray(mesh.faces)))
    return placed


def surface_of_scene(scene: trimesh.Scene | trimesh.Trimesh) -> SurfaceMesh:
    """Flatten a scene whose frame is the world's.

    Raises:
        DataError: If it has no triangles.
    """
    textures: dict[int, Texture] = {}
    parts = [
        part
        for mesh, vertices, faces in placed_meshes(scene)
        for part in _parts(mesh, vertices, faces, textures)
        if len(part.triangles)
    ]
    if not parts:
        raise DataError("scene: found no triangles, expected a mesh with faces.")
    ids = np.repeat(np.arange(len(parts), dtype=np.int32), [len(part.triangles) for part in parts])
    return SurfaceMesh(
        triangles=np.concatenate([part.triangles for part in parts]).astype(np.float32),
        uvs=np.concatenate([part.uvs for part in parts]).astype(np.float32),
        colors=np.concatenate([part.colors for part in parts]).astype(np.float32),
        material_ids=ids,
        materials=tuple(part.material for part in parts),
    )


def _parts(
    mesh: trimesh.Trimesh, vertices: np.ndarray, faces: np.ndarray, textures: dict[int, Texture]
) -> list[_Part]:
    visual = mesh.visual
    colors = _corner_colors(mesh, faces)
    if not isinstance(visual, TextureVisuals):
        plain = SurfaceMaterial(factor=np.ones(4, np.float32))
        return [_Part(vertices[faces], np.zeros((len(faces), 3, 2)), colors, plain)]
    uvs = np.zeros((len(faces), 3, 2)) if visual.uv is None else np.asarray(visual.uv)[faces]
    has_uv = visual.uv is not None
    if isinstance(visual.material, MultiMaterial) and visual.face_materials is not None:
        face_materials = np.asarray(visual.face_materials)
        choices = [(face_materials == index, each) for index, each in enumerate(visual.material.materials)]
    else:
        choices = [(np.ones(len(faces), dtype=bool), visual.material)]
    return [
        _Part(vertices[faces[chosen]], uvs[chosen], colors[chosen], _material(mesh, each, has_uv, textures))
        for chosen, each in choices
    ]


def _corner_colors(mesh: trimesh.Trimesh, faces: np.ndarray) -> np.ndarray:
    """Linear RGBA of the corners (M, 3, 4)."""
    visual = mesh.visual
    if isinstance(visual, TextureVisuals):
        stored = visual.vertex_attributes.get("color")
        if stored is None or len(stored) != len(mesh.vertices):
            return np.ones((len(faces), 3, 4), np.float32)
        return _linear(mesh, np.asarray(stored))[faces]
    if isinstance(visual, ColorVisuals) and visual.kind == "vertex":
        colors = _linear(mesh, np.asarray(visual.vertex_colors))[faces]
    elif isinstance(visual, ColorVisuals) and visual.kind == "face":
        colors = np.repeat(_linear(mesh, np.asarray(visual.face_colors))[:, None], 3, axis=1)
    else:
        return np.broadcast_to(_UNKNOWN, (len(faces), 3, 4))
    colors[..., 3] = 1.0  # plain meshes carry no cut-outs; exporters leave any alpha there
    return colors


def _linear(mesh: trimesh.Trimesh, colors: np.ndarray) -> np.ndarray:
    """Linear float32 RGBA (n, 4) of stored colours (n, 3 or 4) of any number type."""
    scale = float(np.iinfo(colors.dtype).max) if np.issubdtype(colors.dtype, np.integer) else 1.0
    values = colors.astype(np.float64) / scale
    rgba = np.ones((len(values), 4))
    rgba[:, : values.shape[1]] = values
    if mesh.metadata.get(COLORS_KEY) == "srgb":
        rgba[:, :3] = linear_from_srgb(rgba[:, :3])
    return rgba.astype(np.float32)


def _material(
    mesh: trimesh.Trimesh, material: object, has_uv: bool, textures: dict[int, Texture]
) -> SurfaceMaterial:
    if isinstance(material, PBRMaterial):
        picture = material.baseColorTexture if has_uv else None
        exact = mesh.metadata.get(FACTOR_KEY)
        if exact is None and material.baseColorFactor is not None:
            exact = np.asarray(material.baseColorFactor, dtype=np.float64) / 255.0
        factor = np.ones(4, np.float32) if exact is None else np.array(exact, np.float32)
        mode = material.alphaMode or "OPAQUE"
        cutoff = None
        if mode == "MASK":
            cutoff = CUTOFF if material.alphaCutoff is None else float(material.alphaCutoff)
        elif mode == "BLEND":  # no layers of glass: half transparent and more is not there
            cutoff = CUTOFF
        return SurfaceMaterial(factor=factor, texture=_texture(picture, textures), cutoff=cutoff)
    if isinstance(material, SimpleMaterial):
        picture = material.image if has_uv else None
        if picture is not None:
            texture = _texture(picture, textures)
            cutoff = CUTOFF if texture is not None and (texture.pixels[..., 3] < 255).any() else None
            return SurfaceMaterial(factor=np.ones(4, np.float32), texture=texture, cutoff=cutoff)
        diffuse = np.asarray(material.diffuse, dtype=np.float64)[:3] / 255.0
        return SurfaceMaterial(factor=np.array((*linear_from_srgb(diffuse), 1.0), np.float32))
    return SurfaceMaterial(factor=_UNKNOWN)


def _texture(picture: Image.Image | None, textures: dict[int, Texture]) -> Texture | None:
    """The texture of a picture, made once for all parts that share it."""
    if picture is None:
        return None
    if id(picture) not in textures:
        textures[id(picture)] = make_texture(_rgba(picture))
    return textures[id(picture)]


def _rgba(picture: Image.Image) -> np.ndarray:
    """Pixels (h, w, 4), uint8."""
    if picture.mode.startswith("I"):  # 16 bits of grey, which Pillow would clip at 255
        picture = Image.fromarray((np.asarray(picture) / 257.0 + 0.5).astype(np.uint8))
    return np.array(picture.convert("RGBA"))
