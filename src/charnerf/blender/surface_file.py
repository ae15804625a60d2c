"""Surfaces as the files that travel between this process and Blender's."""

from pathlib import Path
from typing import Any

import numpy as np

from charnerf.surfaces.surface_mesh import SurfaceMaterial, SurfaceMesh, make_texture


def read_surface(file: Path) -> SurfaceMesh:
    """Read what Blender wrote: triangles in the scene's frame, each part a material."""
    with np.load(file) as arrays:
        textures = [make_texture(arrays[f"texture_{index}"]) for index in range(_textures(arrays.files))]
        return SurfaceMesh(
            triangles=arrays["triangles"],
            uvs=arrays["uvs"],
            colors=arrays["colors"],
            material_ids=arrays["material_ids"],
            materials=tuple(
                SurfaceMaterial(
                    factor=factor,
                    texture=textures[picture] if picture >= 0 else None,
                    cutoff=None if np.isnan(cutoff) else float(cutoff),
                )
                for factor, cutoff, picture in zip(
                    arrays["factors"], arrays["cutoffs"], arrays["picture_of"], strict=True
                )
            ),
        )


def write_surface(file: Path, surface: SurfaceMesh) -> None:
    """Write a surface for Blender; a picture that parts share once."""
    textures = {id(each.texture): each.texture for each in surface.materials if each.texture is not None}
    names = list(textures)
    materials = surface.materials
    pictures: dict[str, Any] = {f"texture_{index}": textures[name].pixels for index, name in enumerate(names)}
    np.savez(
        file,
        triangles=surface.triangles,
        uvs=surface.uvs,
        colors=surface.colors,
        material_ids=surface.material_ids,
        factors=np.stack([each.factor for each in materials]),
        cutoffs=np.array([np.nan if each.cutoff is None else each.cutoff for each in materials]),
        picture_of=np.array(
            [-1 if each.texture is None else names.index(id(each.texture)) for each in materials]
        ),
        **pictures,
    )


def _textures(names: list[str]) -> int:
    return sum(name.startswith("texture_") for name in names)
