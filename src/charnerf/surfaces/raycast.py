"""First hits of rays on a SurfaceMesh, by Embree."""

from dataclasses import dataclass

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from charnerf.surfaces.surface_mesh import SurfaceMesh, shade

_STEP = 2e-5  # m past a cut-out, above float32 rounding at some metres
_MAX_LAYERS = 64


@dataclass(frozen=True)
class Hits:
    """First hits of rays (R,).

    Attributes:
        triangles: Index of the triangle, int32; -1 where the ray meets nothing.
        u: Weight of its second corner.
        v: Weight of its third corner.
        distances: Along the unit direction, m; infinite where the ray meets nothing.
    """

    triangles: np.ndarray
    u: np.ndarray
    v: np.ndarray
    distances: np.ndarray


class RayCaster:
    """Traces rays; a surface has no back side, and alpha cut-outs let rays through."""

    def __init__(self, mesh: SurfaceMesh):
        """Build Embree's tree of the mesh."""
        self._mesh = mesh
        self._scene = rtcore_scene.EmbreeScene()
        corners = np.ascontiguousarray(mesh.triangles.reshape(-1, 3), dtype=np.float32)
        TriangleMesh(
            scene=self._scene,
            vertices=corners,
            indices=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        )

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """Trace rays.

        Args:
            origins: float32 (R, 3), m.
            directions: Unit, float32 (R, 3).
        """
        hits = self._trace(origins, directions)
        if not self._mesh.has_cutouts:
            return hits
        live = np.flatnonzero(hits.triangles >= 0)
        for _ in range(_MAX_LAYERS):
            here = shade(self._mesh, hits.triangles[live], hits.u[live], hits.v[live])[:, 3] > 0.0
            live = live[~here]
            if len(live) == 0:
                break
            passed = hits.distances[live] + _STEP
            behind = self._trace(origins[live] + passed[:, None] * directions[live], directions[live])
            hits.triangles[live], hits.u[live], hits.v[live] = behind.triangles, behind.u, behind.v
            hits.distances[live] = passed + behind.distances
            live = live[behind.triangles >= 0]
        return hits

    def _trace(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        if len(origins) == 0:
            none = np.zeros(0, np.float32)
            return Hits(triangles=np.zeros(0, np.int32), u=none, v=none, distances=none)
        found = self._scene.run(
            np.ascontiguousarray(origins, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
            output=1,
        )
        missed = found["primID"] < 0
        distances = np.where(missed, np.float32(np.inf), found["tfar"])
        return Hits(triangles=found["primID"], u=found["u"], v=found["v"], distances=distances)
