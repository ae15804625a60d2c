"""Points on the surface of a captured mesh: by area, as the paper draws them, or on what the cameras see."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
import torch

from charnerf.data.points import AbstractPoints
from charnerf.data.visibility import Seen, capture_cameras, default_cameras, see_points
from charnerf.errors import DataError
from charnerf.surfaces.color import srgb_from_linear
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.surfaces.surface_mesh import SurfaceMesh, interpolate, shade, triangle_areas
from charnerf.types import Cameras, SurfacePoints

_MAX_ROUNDS = 50


AbstractSurface = AbstractPoints[SurfacePoints]


@dataclass(frozen=True)
class _Draw:
    """Points on triangles: indices (K,), weights u, v (K,) of second and third corner, linear rgb (K, 3)."""

    triangles: np.ndarray
    u: np.ndarray
    v: np.ndarray
    rgb: np.ndarray


@final
class AreaSurface(AbstractSurface):
    """Points spread evenly over the area of all parts, hidden inner faces included.

    Source: paper, Mix of 2d ray sampling and 3d surface sampling (by area, triangle point picking).

    Args:
        mesh: The surface; open parts and triangles without area are normal.

    Raises:
        DataError: If it has no area.
    """

    def __init__(self, mesh: SurfaceMesh):
        self.mesh = mesh
        self._cumulated = torch.from_numpy(np.cumsum(triangle_areas(mesh)))
        if not float(self._cumulated[-1]) > 0.0:
            raise DataError("mesh: found an area of 0 m^2, expected triangles with area; capture it again.")

    def sample(self, num_points: int, generator: torch.Generator) -> SurfacePoints:
        """Draw points by area; see `AbstractPoints.sample`."""
        draw = self.draw(num_points, generator)
        points = interpolate(self.mesh.triangles[draw.triangles], draw.u, draw.v)
        return _surface_points(points, srgb_from_linear(draw.rgb))

    @property
    def size_bytes(self) -> int:
        """Memory of the mesh and its textures."""
        return self.mesh.size_bytes + self._cumulated.nbytes

    def draw(self, num_points: int, generator: torch.Generator) -> _Draw:
        """Draw points by area as triangles and weights; parts that alpha cuts out are drawn again.

        Raises:
            DataError: If alpha leaves nothing of the surface.
        """
        parts, missing = [], num_points
        for _ in range(_MAX_ROUNDS):
            triangles, u, v = self._pick(missing, generator)
            rgba = shade(self.mesh, triangles, u, v)
            here = rgba[:, 3] > 0.0
            parts.append(_Draw(triangles[here], u[here], v[here], rgba[here, :3]))
            missing -= int(here.sum())
            if missing == 0:
                return _joined(parts)
        raise DataError("mesh: alpha cuts out nearly all of its surface; correct its alpha mode or texture.")

    def _pick(self, num_points: int, generator: torch.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        numbers = torch.rand(3, num_points, generator=generator, dtype=torch.float64)
        place = numbers[0] * self._cumulated[-1]
        triangles = torch.searchsorted(self._cumulated, place, right=True).clamp_max(len(self._cumulated) - 1)
        root = numbers[1].sqrt()
        u, v = root * (1.0 - numbers[2]), root * numbers[2]
        return triangles.numpy(), u.numpy(), v.numpy()


@final
class VisibleSurface(AbstractSurface):
    """Points of the outer surface: a pool of points by area, without those that no camera sees.

    Args:
        mesh: The surface.
        cameras: Cameras (N,) that look at it; None for a capture's usual ones.
        pool_size: Points in the pool.

    Raises:
        DataError: If the cameras see none of it.
    """

    def __init__(self, mesh: SurfaceMesh, cameras: Cameras | None = None, *, pool_size: int = 32768):
        points, _, draw = _visible(AreaSurface(mesh), cameras, pool_size, seed=0)
        self._pool = _surface_points(points, srgb_from_linear(draw.rgb))

    def sample(self, num_points: int, generator: torch.Generator) -> SurfacePoints:
        """Draw points of the pool, with replacement; see `AbstractPoints.sample`."""
        chosen = torch.randint(self._pool.points.shape[1], (num_points,), generator=generator)
        return self._pool[:, chosen]

    @property
    def size_bytes(self) -> int:
        """Memory of the pool; the mesh is not kept."""
        return self._pool.points.nbytes + self._pool.rgb.nbytes


def visible_surface_points(
    mesh_file: str | Path, num_points: int, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a character's outer surface, evenly by area.

    Args:
        mesh_file: As `Character.mesh_file` names it; the cameras beside it decide what is seen.
        num_points: n, how many.
        seed: The same seed gives the same points.

    Returns:
        points (n, 3), m; unit normals (n, 3) of the triangles, towards the camera that sees the point;
        rgb (n, 3), sRGB in [0, 1].

    Raises:
        DataError: If the mesh can not be read or the cameras see none of it.
    """
    area = AreaSurface(load_surface_mesh(mesh_file))
    points, seen, draw = _visible(area, capture_cameras(Path(mesh_file)), num_points, seed)
    return points, seen.normals, srgb_from_linear(draw.rgb).astype(np.float32)


def _visible(
    area: AreaSurface, cameras: Cameras | None, num_points: int, seed: int
) -> tuple[np.ndarray, Seen, _Draw]:
    """Points by area that cameras see, exactly num_points of them."""
    cameras = default_cameras(area.mesh) if cameras is None else cameras
    generator = torch.Generator().manual_seed(seed)
    all_points, all_normals, draws, num_visible = [], [], [], 0
    share = 0.6
    for _ in range(_MAX_ROUNDS):
        count = min(int((num_points - num_visible) / share * 1.05) + 64, 4 * num_points + 64)
        draw = area.draw(count, generator)
        points = interpolate(area.mesh.triangles[draw.triangles], draw.u, draw.v).astype(np.float32)
        seen = see_points(area.mesh, points, draw.triangles, cameras)
        visible = seen.visible
        all_points.append(points[visible])
        all_normals.append(seen.normals[visible])
        draws.append(_Draw(draw.triangles[visible], draw.u[visible], draw.v[visible], draw.rgb[visible]))
        num_visible += int(visible.sum())
        share = max(float(visible.mean()), 0.02)
        if num_visible >= num_points:
            kept = slice(0, num_points)
            joined = _joined(draws)
            return (
                np.concatenate(all_points)[kept],
                Seen(visible=np.ones(num_points, dtype=bool), normals=np.concatenate(all_normals)[kept]),
                _Draw(joined.triangles[kept], joined.u[kept], joined.v[kept], joined.rgb[kept]),
            )
    raise DataError("mesh: its cameras see nearly nothing of it; check that mesh and cameras share a frame.")


def _joined(parts: list[_Draw]) -> _Draw:
    if len(parts) == 1:
        return parts[0]
    return _Draw(
        triangles=np.concatenate([part.triangles for part in parts]),
        u=np.concatenate([part.u for part in parts]),
        v=np.concatenate([part.v for part in parts]),
        rgb=np.concatenate([part.rgb for part in parts]),
    )


def _surface_points(points: np.ndarray, rgb: np.ndarray) -> SurfacePoints:
    return SurfacePoints(
        points=torch.from_numpy(points.astype(np.float32))[None],
        rgb=torch.from_numpy(rgb.astype(np.float32))[None],
    )
