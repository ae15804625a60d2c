"""Where rays first meet triangles, by Embree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self, final

import numpy as np
import torch
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from torch import Tensor

from charnerf.geometry.cameras import pixel_rays
from charnerf.surfaces.surface_mesh import SurfaceMesh, shade
from charnerf.types import Cameras

_STEP = 2e-5  # m past a cut-out, above float32 rounding at some metres
_MAX_LAYERS = 64


@dataclass(frozen=True)
class Hits:
    """Rays (R,) and where they first meet a triangle.

    Attributes:
        origins: Of the rays, float32 (R, 3), m.
        directions: Of the rays, unit, float32 (R, 3).
        triangles: Index of the triangle, int32 (R,); -1 where the ray meets nothing.
        u: Weight of its second corner, (R,).
        v: Weight of its third corner, (R,).
        distances: Along the ray, (R,), m; infinite where it meets nothing.
    """

    origins: np.ndarray
    directions: np.ndarray
    triangles: np.ndarray
    u: np.ndarray
    v: np.ndarray
    distances: np.ndarray

    @property
    def hit(self) -> np.ndarray:
        """Whether each ray meets anything, (R,), bool."""
        return self.triangles >= 0

    @property
    def points(self) -> np.ndarray:
        """Where the rays meet the triangles, (R, 3), m; for rays that all do."""
        return self.origins + self.distances[:, None] * self.directions

    def __getitem__(self, index: np.ndarray) -> Hits:
        """The rays of an index array or a mask."""
        return Hits(**{name: value[index] for name, value in vars(self).items()})


@final
class RayCaster:
    """Traces rays; triangles have no back side.

    Args:
        triangles: Corners, (M, 3, 3), m.
        is_there: Whether the surface is there at points of triangles, (K,) bool, by the points' triangles, u
            and v, (K,) each: rays go on where it is not. Everywhere if left out.
    """

    def __init__(
        self,
        triangles: np.ndarray,
        is_there: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray] | None = None,
    ) -> None:
        self._is_there = is_there
        self._scene = EmbreeScene()
        corners = np.ascontiguousarray(triangles, dtype=np.float32).reshape(-1, 3)
        TriangleMesh(
            scene=self._scene,
            vertices=corners,
            indices=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        )

    @classmethod
    def of_surface(cls, mesh: SurfaceMesh) -> Self:
        """Of a surface, whose alpha cut-outs let rays through."""

        def is_there(triangles: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
            return shade(mesh, triangles, u, v)[:, 3] > 0.0

        return cls(mesh.triangles, is_there if mesh.has_cutouts else None)

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """Trace rays with origins and unit directions (R, 3)."""
        hits = self._trace(origins, directions)
        if self._is_there is None:
            return hits
        live = np.flatnonzero(hits.hit)
        for _ in range(_MAX_LAYERS):
            live = live[~self._is_there(hits.triangles[live], hits.u[live], hits.v[live])]
            if len(live) == 0:
                break
            passed = hits.distances[live] + _STEP
            directions = hits.directions[live]
            behind = self._trace(hits.origins[live] + passed[:, None] * directions, directions)
            hits.triangles[live], hits.u[live], hits.v[live] = behind.triangles, behind.u, behind.v
            hits.distances[live] = passed + behind.distances
            live = live[behind.hit]
        return hits

    def pixel_hits(self, camera: Cameras, pixels: Tensor) -> Hits:
        """Trace the rays of a camera of shape () through pixel positions (R, 2)."""
        rays = pixel_rays(camera.to("cpu", torch.float32), pixels)
        return self.first_hits(rays.origins.numpy(), rays.directions.numpy())

    def occluded(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Whether rays with origins and unit directions (R, 3) meet anything, (R,), bool."""
        if self._is_there is not None:
            return self.first_hits(origins, directions).hit
        if len(origins) == 0:
            return np.zeros(0, dtype=bool)
        answer = self._scene.run(
            np.ascontiguousarray(origins, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
            query="OCCLUDED",
        )
        return np.asarray(answer) != -1

    def reaches(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        *,
        triangles: np.ndarray,
        distances: np.ndarray,
        tolerance: float,
    ) -> np.ndarray:
        """Whether rays come to points of triangles before they meet anything else.

        Args:
            origins: (R, 3), m.
            directions: Unit, (R, 3).
            triangles: On which the points lie, (R,).
            distances: Of the points along the rays, (R,), m.
            tolerance: What a ray meets so near before the point is the point still, m.

        Returns:
            (R,), bool.
        """
        hits = self.first_hits(origins, directions)
        return (hits.triangles == triangles) | (hits.distances > distances - tolerance)

    def _trace(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits on triangles, whether the surface is there or not."""
        origins = np.ascontiguousarray(origins, dtype=np.float32)
        directions = np.ascontiguousarray(directions, dtype=np.float32)
        if len(origins) == 0:
            none = np.zeros(0, np.float32)
            return Hits(origins, directions, np.zeros(0, np.int32), none, none, none)
        answer = self._scene.run(origins, directions, output=1)
        missed = answer["primID"] < 0
        distances = np.where(missed, np.float32(np.inf), answer["tfar"])
        return Hits(origins, directions, answer["primID"], answer["u"], answer["v"], distances)
