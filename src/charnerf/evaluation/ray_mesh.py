"""First hits of rays with a triangle mesh, by Embree."""

from dataclasses import dataclass
from typing import final

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


@dataclass(frozen=True)
class Hits:
    """First hits of rays (R,).

    Attributes:
        rays: Indices of the rays that hit, (K,).
        points: Where, (K, 3), m.
        distances: Along the ray, (K,), m.
        triangles: Which triangle, (K,).
    """

    rays: np.ndarray
    points: np.ndarray
    distances: np.ndarray
    triangles: np.ndarray


@final
class RayMesh:
    """A mesh prepared for rays.

    Args:
        vertices: (N, 3), m.
        faces: (M, 3), indices of vertices.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self._scene = EmbreeScene()
        TriangleMesh(
            scene=self._scene,
            vertices=np.ascontiguousarray(vertices, dtype=np.float32),
            indices=np.ascontiguousarray(faces, dtype=np.int32),
        )

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits of rays with origins and unit directions (R, 3)."""
        origins = np.ascontiguousarray(origins, dtype=np.float32)
        directions = np.ascontiguousarray(directions, dtype=np.float32)
        if not len(origins):
            none = np.zeros(0, np.int64)
            return Hits(none, np.zeros((0, 3), np.float32), np.zeros(0, np.float32), none)
        answer = self._scene.run(origins, directions, output=True)
        rays = np.flatnonzero(answer["primID"] >= 0)
        distances = answer["tfar"][rays]
        points = origins[rays] + distances[:, None] * directions[rays]
        return Hits(rays, points, distances, answer["primID"][rays])

    def occluded(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Whether rays with origins and unit directions (R, 3) hit anything, (R,), bool."""
        if not len(origins):
            return np.zeros(0, dtype=bool)
        answer = self._scene.run(
            np.ascontiguousarray(origins, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
            query="OCCLUDED",
        )
        return np.asarray(answer) != -1
