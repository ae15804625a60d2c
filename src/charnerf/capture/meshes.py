"""Mesh files to scenes in the world frame: +Z up, facing -Y, 2 m tall, feet on z = 0, centred."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from charnerf.errors import ConfigError, DataError
from charnerf.geometry.world import HEIGHT
from charnerf.surfaces.scene_files import is_vrm_0, read_scene
from charnerf.surfaces.scene_mesh import placed_meshes
from charnerf.surfaces.surface_mesh import SurfaceMesh

SUFFIXES = (".glb", ".gltf", ".vrm", ".obj", ".ply", ".stl")
_BY_BLENDER = (".fbx", ".blend", ".dae")
_Y_UP, _Z_UP = ("y", "+z"), ("z", "-y")
_DEFAULT_AXES = {
    **dict.fromkeys((".glb", ".gltf", ".vrm", ".obj", ".fbx", ".dae"), _Y_UP),
    **dict.fromkeys((".ply", ".stl", ".blend"), _Z_UP),
}
_VRM_0_AXES = ("y", "-z")  # VRM 1.0 turned round to +Z
_FACINGS = {"y": ("+z", "-z", "+x", "-x"), "z": ("-y", "+y", "+x", "-x")}


def load_scene(path: str | Path, up: str | None = None, facing: str | None = None) -> trimesh.Scene:
    """Load a mesh file into the world frame.

    Args:
        path: GLB, glTF, VRM, OBJ, PLY or STL.
        up: Axis of the file that points up, "y" or "z"; None for the format's own.
        facing: Signed axis of the file that the character faces, such as "+z" or "-y"; None for the format's
            own.

    Returns:
        A scene whose graph carries the change of frame; colours as surfaces/scene_mesh.py reads them.

    Raises:
        DataError: If the file is missing, of another format, unreadable (surfaces/scene_files.py), without faces, or has
            vertices that are not finite.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        advice = "use --renderer blender" if suffix in _BY_BLENDER else "convert it"
        raise DataError(
            f"{path}: found the suffix {suffix!r}, expected one of {', '.join(SUFFIXES)}; {advice}."
        )
    if not path.is_file():
        raise DataError(f"{path}: no such file, expected a mesh.")
    rotation = axes_rotation(*file_axes(path, up, facing))
    scene = read_scene(path)
    _check_geometry(scene, path)
    return to_world(scene, rotation, where=str(path))


def check_axes(suffix: str, up: str | None, facing: str | None) -> None:
    """Check axes that were given for files of a suffix.

    Raises:
        ConfigError: If they are none, or lie along one another.
    """
    axes_rotation(*_completed(_DEFAULT_AXES[suffix], up, facing))


def turn_of(path: Path, up: str | None, facing: str | None) -> np.ndarray:
    """Rotation (3, 3) to the world from a scene that a program has turned to Z up, facing -Y, by the file's format alone."""
    by_format = axes_rotation(*_DEFAULT_AXES[path.suffix.lower()])
    return axes_rotation(*file_axes(path, up, facing)) @ by_format.T


def file_axes(path: Path, up: str | None, facing: str | None) -> tuple[str, str]:
    """Axes of a file that point up and forwards: those given, the rest as its format has them.

    Args:
        path: The file.
        up: "y", "z" or None.
        facing: Signed axis or None; one along the format's own up axis makes the other axis up.
    """
    own = _DEFAULT_AXES[path.suffix.lower()]
    return _completed(_VRM_0_AXES if is_vrm_0(path) else own, up, facing)


def _completed(own: tuple[str, str], up: str | None, facing: str | None) -> tuple[str, str]:
    own_up, own_facing = own
    if up is None:
        up = own_up if facing is None or facing[-1:] != own_up else {"y": "z", "z": "y"}[own_up]
    if facing is None:
        facing = own_facing if up == own_up else _FACINGS.get(up, ("",))[0]
    return up, facing


def axes_rotation(up: str, facing: str) -> np.ndarray:
    """Rotation (3, 3) from a file's axes to the world's.

    Args:
        up: "y" or "z".
        facing: Signed axis across it.

    Raises:
        ConfigError: If the two are no such axes.
    """
    if up not in _FACINGS or facing not in _FACINGS[up]:
        raise ConfigError(
            f"up = {up!r}, facing = {facing!r}: expected up y with facing one of {', '.join(_FACINGS['y'])}, "
            f"or up z with facing one of {', '.join(_FACINGS['z'])}."
        )
    file_up = _axis("+" + up)
    file_front = _axis(facing)
    file_left = np.cross(file_up, file_front)
    world = np.stack((_axis("+z"), _axis("-y"), np.cross(_axis("+z"), _axis("-y"))), axis=1)
    return world @ np.stack((file_up, file_front, file_left), axis=1).T


def to_world(scene: trimesh.Scene, rotation: np.ndarray, *, where: str) -> trimesh.Scene:
    """Rotate a scene, scale it to 2 m, set its feet on z = 0 and its middle on the z axis.

    Args:
        scene: The scene, in its file's frame; changed and returned.
        rotation: World from file, (3, 3).
        where: What messages name.

    Raises:
        DataError: If it has no height.
    """
    points = np.concatenate([vertices[np.unique(faces)] for _, vertices, faces in placed_meshes(scene)])
    scene.apply_transform(world_from_points(points, rotation, where=where))
    return scene


def surface_to_world(surface: SurfaceMesh, rotation: np.ndarray, *, where: str) -> SurfaceMesh:
    """The same as `to_world` of a surface."""
    corners = surface.triangles.reshape(-1, 3).astype(np.float64)
    transform = world_from_points(corners, rotation, where=where)
    moved = corners @ transform[:3, :3].T + transform[:3, 3]
    return replace(surface, triangles=moved.reshape(-1, 3, 3).astype(np.float32))


def world_from_points(points: np.ndarray, rotation: np.ndarray, *, where: str) -> np.ndarray:
    """Transform (4, 4) that turns points (n, 3), makes them 2 m tall and sets them on z = 0 around the z axis.

    Raises:
        DataError: If they have no height.
    """
    points = points @ rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    height = high[2] - low[2]
    if not height > 1e-9 * max(1.0, float(np.abs(points).max())):
        raise DataError(
            f"{where}: found a height of {height:.3g} along its up axis, expected a body; check --up."
        )
    scale = HEIGHT / height
    transform = np.eye(4)
    transform[:3, :3] = scale * rotation
    transform[:3, 3] = -scale * np.array(((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]))
    return transform


def _axis(name: str) -> np.ndarray:
    vector = np.zeros(3)
    vector["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return vector


def _check_geometry(scene: trimesh.Scene, path: Path) -> None:
    meshes = placed_meshes(scene)
    if not meshes:
        raise DataError(
            f"{path}: found no faces, expected a triangle mesh; point clouds and lines can not be captured."
        )
    for mesh, vertices, faces in meshes:
        name = mesh.metadata.get("name", "mesh")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise DataError(f"{path}: {name}: a face names a vertex that is not there; export it again.")
        bad = int((~np.isfinite(vertices)).any(axis=1).sum())
        if bad:
            raise DataError(
                f"{path}: {name}: found {bad} of {len(vertices)} vertices not finite (NaN or infinity), "
                "expected numbers; repair the mesh."
            )
