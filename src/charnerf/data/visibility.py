"""Which points of a surface some camera sees."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from charnerf.data.layout import TRANSFORMS_FILE
from charnerf.data.transforms import read_transforms
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.geometry.framing import framing_cameras, source_cameras
from charnerf.surfaces.raycast import RayCaster
from charnerf.surfaces.surface_mesh import SurfaceMesh, triangle_normals
from charnerf.types import Cameras

_TOLERANCE = 2e-5  # m in front of a point that is still the point: float32 along rays of some metres
_MIN_COSINE = 0.01  # flatter than this, a ray that leaves a body beside an edge passes for one that enters


@dataclass(frozen=True)
class Seen:
    """What cameras see of points (K,): visible, bool; normals (K, 3) towards the first camera that does."""

    visible: np.ndarray
    normals: np.ndarray


def see_points(mesh: SurfaceMesh, points: np.ndarray, triangles: np.ndarray, cameras: Cameras) -> Seen:
    """Ask each camera for the points that none before it saw.

    Args:
        mesh: The surface.
        points: On it, float32 (K, 3), m.
        triangles: Their triangles, (K,).
        cameras: (N,).
    """
    caster = RayCaster.of_surface(mesh)
    normals = triangle_normals(mesh)[triangles]
    visible = np.zeros(len(points), dtype=bool)
    hidden = np.arange(len(points))
    for index in spread_order(len(cameras.orthographic)):
        if len(hidden) == 0:
            break
        origins, directions, distances = _rays_to(cameras[index], points[hidden])
        seen = caster.reaches(
            origins, directions, triangles=triangles[hidden], distances=distances, tolerance=_TOLERANCE
        )
        cosines = (normals[hidden] * directions).sum(axis=-1)
        seen &= np.abs(cosines) > _MIN_COSINE
        normals[hidden[seen & (cosines > 0.0)]] *= -1.0
        visible[hidden[seen]] = True
        hidden = hidden[~seen]
    return Seen(visible=visible, normals=normals)


def capture_cameras(mesh_file: Path) -> Cameras | None:
    """Target cameras of the character that a mesh file lies in, None where there is no transforms.json."""
    folder = mesh_file.parent.parent
    return read_transforms(folder).cameras if (folder / TRANSFORMS_FILE).is_file() else None


def default_cameras(mesh: SurfaceMesh) -> Cameras:
    """Cameras (51,) as a capture sets them: a Fibonacci hemisphere and the three source views."""
    radius, size = mesh.framing_radius, 128
    targets = framing_cameras(fibonacci_hemisphere(48), radius=radius, size=size)
    return Cameras.joined([targets, source_cameras(radius=radius, size=size, orthographic=False)])


def _rays_to(camera: Cameras, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays of a camera through points (K, 3): origins, unit directions, distances to the points."""
    pose = camera.world_from_camera.double().numpy()
    if bool(camera.orthographic):
        distances = (pose[:3, 3] - points) @ pose[:3, 2]
        directions = np.broadcast_to(-pose[:3, 2], points.shape).astype(np.float32)
        return (points - distances[:, None] * directions).astype(np.float32), directions, distances
    offsets = points - pose[:3, 3]
    distances = np.linalg.norm(offsets, axis=-1)
    directions = (offsets / distances[:, None]).astype(np.float32)
    return np.broadcast_to(pose[:3, 3], points.shape).astype(np.float32), directions, distances


def spread_order(count: int) -> list[int]:
    """Indices in an order that soon covers all directions, so that few cameras see most points."""
    return sorted(range(count), key=lambda index: (index * 0.618034) % 1.0)
