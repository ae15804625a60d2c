"""Meshes to files: axes and colour encoding as each format wants them, written aside and then renamed."""

from pathlib import Path

import numpy as np
import trimesh

from charnerf.errors import DataError
from charnerf.files import write_bytes
from charnerf.meshing.exported import ExportedMesh, exported, welded
from charnerf.meshing.gltf import encode_glb, encode_gltf
from charnerf.meshing.obj import encode_obj
from charnerf.meshing.usd import check_usd, encode_usdz

SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", ".usdz")
TEXTURED_SUFFIXES = (".glb", ".gltf", ".obj", ".usdz")


def check_format(suffix: str) -> None:
    """Check, before the work, that a format such as .usdz can be written here.

    Raises:
        DependencyError: If it needs a library that is missing.
    """
    if suffix == ".usdz":
        check_usd()


def save_mesh(mesh: trimesh.Trimesh, path: str | Path) -> Path:
    """Write a mesh of our world frame (Z up, facing -Y, metres) to a file.

    GLB, glTF, OBJ and USDZ come out Y up and facing +Z, PLY and STL Z up and facing -Y. Vertex colours of the
    mesh are sRGB-encoded, as pictures are; glTF and USDZ get them linear, as they demand, OBJ and PLY as they
    are, STL has none. A texture lies inside of GLB, glTF and USDZ; OBJ gets an MTL and a PNG file beside it;
    PLY and STL have none: PLY gets the texture's colours at the vertices.

    Args:
        mesh: With vertex colours, a base-colour texture, or neither.
        path: File to write; its suffix names the format: .glb, .gltf, .obj, .ply, .stl, .usdz.

    Returns:
        The path written.

    Raises:
        DataError: If the suffix is unknown, the folder missing, or the mesh has no faces or vertices that
            are not finite.
        DependencyError: If the format needs a library that is missing (.usdz: extra `usd`).
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
    files = _encode(exported(mesh, suffix, path.stem), suffix)
    for other, content in files.items():
        if other != suffix:
            write_bytes(path.with_suffix(other), content)
    write_bytes(path, files[suffix])
    return path


def _encode(mesh: ExportedMesh, suffix: str) -> dict[str, bytes]:
    """The files by suffix."""
    if suffix == ".glb":
        return {suffix: encode_glb(mesh)}
    if suffix == ".gltf":
        return {suffix: encode_gltf(mesh)}
    if suffix == ".usdz":
        return {suffix: encode_usdz(mesh)}
    if suffix == ".obj":
        return encode_obj(mesh)
    bare = welded(mesh)
    turned = trimesh.Trimesh(bare.vertices, bare.faces, process=False)
    if bare.rgba is not None and suffix != ".stl":
        rgba = np.round(255.0 * bare.rgba).astype(np.uint8)
        turned.visual = trimesh.visual.ColorVisuals(turned, vertex_colors=rgba)
    content = turned.export(file_type=suffix[1:])
    return {suffix: content.encode() if isinstance(content, str) else bytes(content)}  # type: ignore[arg-type]
