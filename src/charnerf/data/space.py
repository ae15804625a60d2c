"""Points in the hull labelled inside or outside of the character, and what draws them."""

from typing import final

import numpy as np
import torch
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.data.points import AbstractPoints
from charnerf.data.surface import AreaSurface
from charnerf.data.visibility import spread_order
from charnerf.errors import DataError
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.geometry.hull import hull_contains
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.surfaces.raycast import RayCaster
from charnerf.surfaces.surface_mesh import SurfaceMesh
from charnerf.types import Hull, SpacePoints

_ROUNDS = 50

AbstractSpace = AbstractPoints[SpacePoints]


@final
class SolidSpace(AbstractSpace):
    """Points labelled by the mesh: inside is what no ray to the sky leaves (beyond the paper).

    Open parts, doubled walls and wrong windings are normal in characters, so that no winding number would do; and no camera looks
    from below, so that the inside of a robe that is open at the floor belongs to the character.

    Args:
        character: The files; the mesh is read.
        images: Of its targets; not read.
        hull: Of its drawings, B = 1; points lie within.
        pool_size: Points labelled once; samples are drawn of them, with replacement.
        near_share: Share of them beside the surface; the others go all through the hull.
        spread: Standard deviation of their distance from the surface, m.
        num_directions: Rays a point.

    Raises:
        DataError: If the character has no mesh.
    """

    def __init__(
        self,
        character: Character,
        images: Tensor,
        hull: Hull,
        *,
        pool_size: int,
        near_share: float,
        spread: float,
        num_directions: int,
    ) -> None:
        if character.mesh_file is None:
            raise DataError(
                f"{character.folder}: found no mesh, expected one to label points by; capture the character again, or set "
                "space=silhouettes."
            )
        mesh = load_surface_mesh(character.mesh_file)
        generator = torch.Generator().manual_seed(0)
        num_near = round(near_share * pool_size)
        points = torch.cat(
            (
                hull_points(hull, pool_size - num_near, generator),
                _near_points(mesh, hull, num_near, spread, generator),
            )
        )
        inside = is_inside(RayCaster.of_surface(mesh), points.numpy(), num_directions)
        self._points, self._inside = points, torch.from_numpy(inside)

    def sample(self, num_points: int, generator: torch.Generator) -> SpacePoints:
        """Draw points of the pool; see `AbstractPoints.sample`."""
        chosen = torch.randint(len(self._points), (num_points,), generator=generator)
        return SpacePoints(self._points[chosen][None], self._inside[chosen].float()[None])

    @property
    def size_bytes(self) -> int:
        """Memory of the pool; the mesh is not kept."""
        return self._points.nbytes + self._inside.nbytes


def is_inside(caster: RayCaster, points: np.ndarray, num_directions: int) -> np.ndarray:
    """Whether no ray from points (P, 3) into the upper hemisphere escapes, (P,), bool.

    Args:
        caster: Of the character's triangles.
        points: Float32, m.
        num_directions: Rays a point at most; one that has escaped ends the asking. Spread evenly (a Fibonacci hemisphere).
    """
    inside = np.ones(len(points), dtype=bool)
    unsettled = np.arange(len(points))
    sky = fibonacci_hemisphere(num_directions)[spread_order(num_directions)]
    for direction in sky.numpy().astype(np.float32):
        held = caster.occluded(points[unsettled], np.broadcast_to(direction, (len(unsettled), 3)))
        inside[unsettled[~held]] = False
        unsettled = unsettled[held]
    return inside


def hull_points(hull: Hull, num_points: int, generator: torch.Generator) -> Tensor:
    """Points (num_points, 3), m, all through the occupied cells of a hull (B = 1)."""
    cells = hull.occupancy[0].reshape(-1).nonzero()[:, 0]
    side = hull.occupancy.shape[1]
    picked = cells[torch.randint(len(cells), (num_points,), generator=generator)]
    index = torch.stack((picked // (side * side), picked // side % side, picked % side), dim=-1)
    jitter = torch.rand(index.shape, generator=generator)
    return hull.box_min[0] + (index + jitter) * ((hull.box_max[0] - hull.box_min[0]) / side)


def _near_points(
    mesh: SurfaceMesh, hull: Hull, num_points: int, spread: float, generator: torch.Generator
) -> Tensor:
    """Points (num_points, 3) of the hull at normal distances from the surface; where none is, from all through the hull."""
    surface, kept, missing = AreaSurface(mesh), [torch.zeros(0, 3)], num_points
    for _ in range(_ROUNDS):
        if missing <= 0:
            break
        points = surface.sample(2 * missing, generator).points[0]
        points = points + spread * torch.randn(points.shape, generator=generator)
        kept.append(points[hull_contains(hull[0], points)][:missing])
        missing -= len(kept[-1])
    return torch.cat([*kept, hull_points(hull, missing, generator)])
