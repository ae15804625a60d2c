"""Meshes to files: axes and colour encoding as each format wants them, written aside and then renamed."""

import os
import tempfile
from pathlib import Path

import numpy as np
import trimesh

from charnerf.errors import DataError
from charnerf.meshing.axes import vertices_for
from charnerf.meshing.extract import vertex_colours
from charnerf.meshing.gltf import encode_glb, encode_gltf

SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")


def save_mesh(mesh: trimesh.Trimesh, path: str | Path) -> Path:
    """Write a mesh of our world frame (Z up, facing -Y, metres) to a file.

    GLB, glTF and OBJ come out Y up and facing +Z, PLY and STL Z up and facing -Y. Vertex colours of the mesh
    are sRGB-encoded, as pictures are; glTF gets them linear, as it demands, OBJ and PLY as they are, STL has
    none.

    Args:
        mesh: With vertex colours or without.
        path: File to write; its suffix names the format: .glb, .gltf, .obj, .ply, .stl.

    Returns:
        The path written.

    Raises:
        DataError: If the suffix is unknown, the folder missing, or the mesh has no faces or vertices that
            are not finite.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise DataError(
            f"{path}: found suffix '{path.suffix}', expected one of {', '.join(SUFFIXES)}. Rename the file."
        )
    if not path.parent.is_dir():
        raise DataError(f"{path}: found no folder {path.parent}, expected one that exists. Create it first.")
    if len(mesh.faces) == 0:
        raise DataError(f"{path}: found a mesh without faces, expected a surface to write.")
    if not np.isfinite(mesh.vertices).all():
        raise DataError(f"{path}: found vertices that are not finite, expected finite positions in metres.")
    write_aside(path, _encode(mesh, suffix, path.stem))
    return path


def write_aside(path: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all."""
    handle, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        Path(aside).chmod(0o644)
        Path(aside).replace(path)
    except BaseException:
        Path(aside).unlink(missing_ok=True)
        raise


def _encode(mesh: trimesh.Trimesh, suffix: str, name: str) -> bytes:
    """The file's bytes."""
    vertices = vertices_for(suffix, mesh.vertices)
    rgba = vertex_colours(mesh)
    if suffix in (".glb", ".gltf"):
        encode = encode_glb if suffix == ".glb" else encode_gltf
        normals = vertices_for(suffix, mesh.vertex_normals)
        return encode(vertices, normals, np.asarray(mesh.faces), None if rgba is None else rgba / 255.0, name)
    turned = trimesh.Trimesh(vertices, mesh.faces, process=False)
    if rgba is not None and suffix != ".stl":
        turned.visual = trimesh.visual.ColorVisuals(turned, vertex_colors=rgba)
    content = turned.export(file_type=suffix[1:])
    return content.encode() if isinstance(content, str) else bytes(content)  # type: ignore[arg-type]
