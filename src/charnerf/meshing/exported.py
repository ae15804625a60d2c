"""A mesh as a file format wants it: its axes, and what of colours it has."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image

from charnerf.meshing.axes import vertices_for
from charnerf.meshing.extract import vertex_colors
from charnerf.pictures import read_bilinear


@dataclass(frozen=True)
class ExportedMesh:
    """One mesh in the axes of a file format, ready to be written.

    Attributes:
        name: Of node, mesh and files beside.
        vertices: (P, 3), m.
        normals: (P, 3).
        faces: (T, 3), indices.
        rgba: (P, 4), sRGB-encoded in [0, 1], or None.
        uv: (P, 2), v upwards, or None.
        picture: Base colour, sRGB-encoded; there exactly if uv is.
    """

    name: str
    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    rgba: np.ndarray | None
    uv: np.ndarray | None
    picture: Image.Image | None

    def png(self) -> bytes:
        """The picture as a PNG file."""
        assert self.picture is not None
        stream = io.BytesIO()
        self.picture.convert("RGB").save(stream, format="PNG")
        return stream.getvalue()


def exported(mesh: trimesh.Trimesh, suffix: str, name: str) -> ExportedMesh:
    """Turn a mesh of the world frame into the axes of a format.

    Args:
        mesh: With vertex colours, a base-colour texture, or neither.
        suffix: Of the format, such as ".glb".
        name: Of the mesh.
    """
    rgba, picture = vertex_colors(mesh), texture_picture(mesh)
    return ExportedMesh(
        name=name,
        vertices=vertices_for(suffix, mesh.vertices),
        normals=vertices_for(suffix, mesh.vertex_normals),
        faces=np.asarray(mesh.faces),
        rgba=None if rgba is None else rgba / 255.0,
        uv=None if picture is None else np.asarray(mesh.visual.uv, np.float64),  # type: ignore[union-attr]
        picture=picture,
    )


def texture_picture(mesh: trimesh.Trimesh) -> Image.Image | None:
    """The base-colour texture of a mesh that has one and lies in it, else None."""
    visual = mesh.visual
    if not isinstance(visual, trimesh.visual.TextureVisuals) or visual.uv is None:
        return None
    material = visual.material
    picture = getattr(material, "baseColorTexture", None)
    return picture if picture is not None else getattr(material, "image", None)


def welded(mesh: ExportedMesh) -> ExportedMesh:
    """The mesh with vertices that were split at texture seams joined again, coloured by the texture there."""
    if mesh.uv is None or mesh.picture is None:
        return mesh
    keys = np.concatenate((mesh.vertices, mesh.normals), axis=1)
    _, first, joined = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    joined = joined.reshape(-1)
    read = read_texture(mesh.picture, mesh.uv)
    counts = np.bincount(joined)[:, None]
    mean = np.stack([np.bincount(joined, weights=read[:, c]) for c in range(3)], axis=1) / counts
    return ExportedMesh(
        name=mesh.name,
        vertices=mesh.vertices[first],
        normals=mesh.normals[first],
        faces=joined[mesh.faces],
        rgba=np.concatenate((mean, np.ones((len(mean), 1))), axis=1),
        uv=None,
        picture=None,
    )


def read_texture(picture: Image.Image, uv: np.ndarray) -> np.ndarray:
    """Colours (P, 3) in [0, 1] of a texture at places (P, 2), v upwards, between texels bilinearly."""
    values = np.asarray(picture.convert("RGB"), np.float64) / 255.0
    height, width = values.shape[:2]
    return read_bilinear(values, np.stack((uv[:, 0] * width, (1.0 - uv[:, 1]) * height), axis=1))
