"""Mesh files of other programs to scenes in their own axes, with colours as surfaces/scene_mesh.py reads them."""

import io
from functools import partial
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual.material import MultiMaterial

from charnerf.errors import DataError
from charnerf.surfaces import plain_obj, plain_ply
from charnerf.surfaces.foreign_files import OwnFolder, pictures_checked, read_whole
from charnerf.surfaces.gltf_document import GltfDocument, read_gltf
from charnerf.surfaces.plain_gltf import make_plain
from charnerf.surfaces.scene_mesh import COLORS_KEY, FACTOR_KEY

GLTF_SUFFIXES = (".glb", ".gltf", ".vrm")


def read_scene(path: Path) -> trimesh.Scene:
    """Read a mesh file; nothing outside its folder is opened.

    Args:
        path: GLB, glTF, VRM, OBJ, PLY, STL, or what else trimesh reads.

    Raises:
        DataError: If it can not be read, needs what is not supported, or names a file or picture that is missing or broken.
    """
    try:
        scene = _read_scene(path)
        for node in scene.graph.nodes_geometry:  # whose names trimesh encodes
            name = scene.graph[node][1]
            mesh = scene.geometry[name]
            if isinstance(mesh, trimesh.Trimesh) and mesh.vertices.shape[1:] != (3,):
                raise DataError(
                    f"{name}: found vertices {mesh.vertices.shape}, expected (n, 3); export it again."
                )
        _load_pictures(scene)
    except (MemoryError, KeyboardInterrupt):
        raise
    except DataError as err:
        message = str(err)  # those of guards say it already
        raise DataError(message if message.startswith(f"{path}:") else f"{path}: {message}") from err
    except Exception as err:  # readers raise every kind
        raise DataError(
            f"{path}: can not be read as a mesh ({type(err).__name__}: {err}); export it again."
        ) from err
    return scene


def check_files(path: Path) -> None:
    """Check what a file names for another program that will open it: nothing outside its folder, no broken glTF.

    Raises:
        DataError: If something is missing, lies elsewhere, or can not be read.
    """
    try:
        neighbour = partial(_neighbour, OwnFolder(path, []))
        if path.suffix.lower() in GLTF_SUFFIXES:
            make_plain(read_gltf(path, neighbour), neighbour)
        elif path.suffix.lower() == ".obj":
            plain_obj.used_materials(read_whole(path), neighbour)
    except (KeyError, TypeError, ValueError, IndexError) as err:
        message = str(err)
        raise DataError(
            message if message.startswith(f"{path}:") else f"{path}: {message or type(err).__name__}"
        ) from err


def is_vrm_0(path: Path) -> bool:
    """Whether a file is a VRM of version 0, whose characters face the other way."""
    if path.suffix.lower() != ".vrm":
        return False
    try:
        return "VRM" in read_gltf(path, lambda _: b"").tree.get("extensions", {})
    except (DataError, KeyError, TypeError, ValueError):
        return False  # who reads it says what is wrong


def _read_scene(path: Path) -> trimesh.Scene:
    suffix, refused, document = path.suffix.lower(), list[str](), None
    folder = OwnFolder(path, refused)
    neighbour = partial(_neighbour, folder)
    if suffix in GLTF_SUFFIXES:
        document = read_gltf(path, neighbour)
        make_plain(document, neighbour)
        content, suffix = document.to_glb(), ".glb"
    else:
        content = read_whole(path)
    if suffix == ".obj":
        folder = OwnFolder(path, refused, plain_obj.used_materials(content, neighbour))
        content = plain_obj.plain_faces(content)
    elif suffix == ".ply":
        plain_ply.check_texture(content, neighbour)
        content = plain_ply.plain_faces(content)
    with pictures_checked(str(path), refused):
        scene = trimesh.load_scene(
            io.BytesIO(content), file_type=suffix.lstrip("."), resolver=folder, process=False
        )
    if refused:
        raise DataError(refused[0])
    if document is not None:
        _keep_factors(scene, document)
        return scene
    for mesh in scene.geometry.values():
        mesh.metadata[COLORS_KEY] = "srgb"
    return scene


def _neighbour(folder: OwnFolder, name: str) -> bytes:
    """Content of a file that the mesh names.

    Raises:
        DataError: If it is missing or lies outside the mesh's folder.
    """
    try:
        return folder.get(name)
    except FileNotFoundError as err:
        raise DataError(
            f"names {name}, which is not in its folder; put it there, or export the mesh again."
        ) from err


def _keep_factors(scene: trimesh.Scene, document: GltfDocument) -> None:
    """Keep glTF's colour factors in full."""
    factors: dict[str, list[np.ndarray]] = {}
    for material in document.tree.get("materials", []):
        factor = material.get("pbrMetallicRoughness", {}).get("baseColorFactor")
        if factor is not None:
            factors.setdefault(material.get("name"), []).append(np.array(factor, dtype=np.float64))
    for mesh in scene.geometry.values():
        kept = getattr(getattr(mesh.visual, "material", None), "baseColorFactor", None)
        if kept is None:
            continue
        for factor in factors.get(mesh.visual.material.name, []):
            if np.abs(factor * 255.0 - kept).max() <= 1.0:
                mesh.metadata[FACTOR_KEY] = factor.tolist()
                break


def _load_pictures(scene: trimesh.Scene) -> None:
    """Decode the pictures of base colours, which are read lazily else.

    Raises:
        DataError: If one is broken.
    """
    for mesh in scene.geometry.values():
        material = getattr(mesh.visual, "material", None)
        for each in material.materials if isinstance(material, MultiMaterial) else [material]:
            picture = getattr(each, "baseColorTexture", None) or getattr(each, "image", None)
            if picture is None:
                continue
            try:
                picture.load()
            except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as err:
                name = getattr(each, "name", None)
                raise DataError(
                    f"the picture of material {name!r} can not be read ({err}); export it again."
                ) from err
