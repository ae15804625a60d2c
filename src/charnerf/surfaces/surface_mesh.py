"""A textured triangle soup: what capture traces, what lies in mesh/, and what surface points are drawn from.

Letters: M triangles, K points on them. A point on a triangle is given by the weights (u, v) of its second and third
corner.
"""

from dataclasses import dataclass

import numpy as np

from charnerf.geometry.framing import framing_radius
from charnerf.geometry.world import CENTRE
from charnerf.surfaces.color import linear_from_bytes

CUTOFF = 0.5


@dataclass(frozen=True)
class Texture:
    """A picture on a surface, repeated in both directions.

    Attributes:
        levels: Linear-light RGBA, float32 (h, w, 4) each; every level halves the one before.
        pixels: The picture itself, uint8 (h, w, 4), sRGB-encoded.
    """

    levels: tuple[np.ndarray, ...]
    pixels: np.ndarray


@dataclass(frozen=True)
class SurfaceMaterial:
    """Colour of a part: factor times texture times the corners' colours.

    Attributes:
        factor: Linear RGBA, float32 (4,).
        texture: Its picture, if any.
        cutoff: Alpha below which the surface is not there; None for an opaque material.
    """

    factor: np.ndarray
    texture: Texture | None = None
    cutoff: float | None = None


@dataclass(frozen=True)
class SurfaceMesh:
    """Triangles with colours, world frame, metres.

    Attributes:
        triangles: Corners, float32 (M, 3, 3).
        uvs: Texture coordinates of the corners, float32 (M, 3, 2), v upwards; zero where there is no texture.
        colors: Linear RGBA of the corners, float32 (M, 3, 4); one where there is none.
        material_ids: Index into materials, int32 (M,), ascending.
        materials: Materials.
    """

    triangles: np.ndarray
    uvs: np.ndarray
    colors: np.ndarray
    material_ids: np.ndarray
    materials: tuple[SurfaceMaterial, ...]

    @property
    def size_bytes(self) -> int:
        """Memory of triangles and textures."""
        arrays = [self.triangles, self.uvs, self.colors, self.material_ids]
        for material in self.materials:
            if material.texture is not None:
                arrays += [material.texture.pixels, *material.texture.levels]
        return sum(array.nbytes for array in arrays)

    @property
    def framing_radius(self) -> float:
        """Radius of the sphere that pictures of the whole surface frame, m."""
        return framing_radius(
            float(np.linalg.norm(self.triangles.reshape(-1, 3) - np.array(CENTRE), axis=-1).max())
        )

    @property
    def has_cutouts(self) -> bool:
        """Whether a part of the surface may be cut out by alpha."""
        return any(material.cutoff is not None for material in self.materials)


def make_texture(pixels: np.ndarray) -> Texture:
    """A texture with its smaller levels, averaged in linear light.

    Args:
        pixels: uint8 (h, w, 4), sRGB-encoded, straight alpha.
    """
    level = np.concatenate(
        (linear_from_bytes(pixels[..., :3]), pixels[..., 3:].astype(np.float32) / 255.0), axis=-1
    )
    levels = [level]
    while min(level.shape[:2]) >= 2:
        height, width = (side // 2 * 2 for side in level.shape[:2])
        level = level[:height, :width].reshape(height // 2, 2, width // 2, 2, 4).mean(axis=(1, 3))
        levels.append(level)
    return Texture(levels=tuple(levels), pixels=pixels)


def triangle_areas(mesh: SurfaceMesh) -> np.ndarray:
    """Areas of the triangles, float64 (M,), m^2."""
    first, second, third = np.moveaxis(mesh.triangles.astype(np.float64), 1, 0)
    return 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=-1)


def triangle_normals(mesh: SurfaceMesh) -> np.ndarray:
    """Unit normals by the corners' order, float32 (M, 3); zero for triangles without area."""
    first, second, third = np.moveaxis(mesh.triangles.astype(np.float64), 1, 0)
    normals = np.cross(second - first, third - first)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0).astype(np.float32)


def interpolate(corners: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Values (K, C) at points of triangles from the values (K, 3, C) at their corners."""
    u, v = u[:, None], v[:, None]
    return (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]


def texture_levels(mesh: SurfaceMesh, footprint: float) -> np.ndarray:
    """Which level of its texture each triangle is read from, so that one texel is about one footprint.

    Args:
        mesh: The mesh.
        footprint: Distance between neighbouring samples on a surface seen frontally, m.

    Returns:
        Levels, int32 (M,); 0 for the full picture, and for triangles whose alpha cuts out.
    """
    edges_uv = mesh.uvs[:, 1:] - mesh.uvs[:, :1]
    uv_areas = 0.5 * np.abs(edges_uv[:, 0, 0] * edges_uv[:, 1, 1] - edges_uv[:, 0, 1] * edges_uv[:, 1, 0])
    sizes = np.array(
        [
            material.texture.pixels.shape[0] * material.texture.pixels.shape[1]
            if material.texture is not None and material.cutoff is None
            else 0
            for material in mesh.materials
        ],
        dtype=np.float64,
    )
    texels = uv_areas * sizes[mesh.material_ids]
    areas = triangle_areas(mesh)
    density = np.divide(texels, areas, out=np.zeros_like(texels), where=areas > 1e-12)  # texels per m^2
    levels = 0.5 * np.log2(np.maximum(density * footprint**2, 1.0))
    return np.floor(levels + 0.5).astype(np.int32)


def shade(
    mesh: SurfaceMesh, triangles: np.ndarray, u: np.ndarray, v: np.ndarray, levels: np.ndarray | None = None
) -> np.ndarray:
    """Unlit colours of points of the surface.

    Args:
        mesh: The mesh.
        triangles: Indices of the points' triangles, (K,).
        u: Weight of the second corner, (K,).
        v: Weight of the third corner, (K,).
        levels: Texture level of each triangle of the mesh, (M,), from `texture_levels`; the full picture
            without.

    Returns:
        Linear RGBA, float32 (K, 4); alpha is 1 or 0: whether the surface is there.
    """
    rgba = interpolate(mesh.colors[triangles], u, v).astype(np.float32)
    material_of = mesh.material_ids[triangles]
    for index in np.unique(material_of):
        material = mesh.materials[index]
        chosen = slice(None) if len(mesh.materials) == 1 else np.flatnonzero(material_of == index)
        if material.texture is not None:
            uv = interpolate(mesh.uvs[triangles[chosen]], u[chosen], v[chosen])
            level_of = np.zeros(len(uv), np.int32) if levels is None else levels[triangles[chosen]]
            rgba[chosen] *= _read_texture(material.texture, uv, level_of)
        rgba[chosen] *= material.factor
        rgba[chosen, 3] = 1.0 if material.cutoff is None else rgba[chosen, 3] >= material.cutoff
    return rgba


def _read_texture(texture: Texture, uv: np.ndarray, level_of: np.ndarray) -> np.ndarray:
    level_of = np.minimum(level_of, len(texture.levels) - 1)
    used = np.unique(level_of)
    if len(used) == 1:
        return _bilinear(texture.levels[used[0]], uv)
    rgba = np.zeros((len(uv), 4), np.float32)
    for level in used:
        chosen = np.flatnonzero(level_of == level)
        rgba[chosen] = _bilinear(texture.levels[level], uv[chosen])
    return rgba


def _bilinear(picture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Values (K, 4) of a repeated picture (h, w, 4) at texture coordinates (K, 2)."""
    height, width = picture.shape[:2]
    uv = uv - np.floor(uv)
    x = uv[:, 0] * width - 0.5
    y = (1.0 - uv[:, 1]) * height - 0.5
    left, top = np.floor(x), np.floor(y)
    fx, fy = (x - left)[:, None].astype(np.float32), (y - top)[:, None].astype(np.float32)
    x0, y0 = left.astype(np.int64) % width, top.astype(np.int64) % height
    x1, y1 = (x0 + 1) % width, (y0 + 1) % height
    flat = picture.reshape(-1, 4)
    upper = flat[y0 * width + x0] * (1.0 - fx) + flat[y0 * width + x1] * fx
    lower = flat[y1 * width + x0] * (1.0 - fx) + flat[y1 * width + x1] * fx
    return upper * (1.0 - fy) + lower * fy
