"""Samples on the occupied part of rays, and a field's answers inside of a scene's bounds, chunk by chunk.

Samples are placed in the arc length `s` along the occupied steps of a ray, which runs from 0 to the occupied length: outside the
hull the density is zero by definition, so that the integral over s is the integral over the ray. Without a hull the whole interval
in the box counts.

Letters: R rays, N steps, S samples a ray, P points.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.geometry.bounds import Bounds
from charnerf.geometry.hull import occupied_edges
from charnerf.geometry.rays import OccupiedLength, box_interval, points_along
from charnerf.geometry.sampling import edges_from_t_vals, merge_t_vals, stratified_t_vals
from charnerf.scene import AbstractField
from charnerf.types import FieldOutput, RayBundle, TensorRecord
from charnerf.volume.quadrature.base import AbstractQuadrature

# more leave the caches: 8192 cost as much a point, 16384 nearly twice (two cores of a server)
POINTS_AT_ONCE = 4096
# of a wide field: layers of 6 MiB; above, the system hands out the memory of each tensor anew (width 512, one core: a fifth longer
# with 16 MiB)
BYTES_AT_ONCE = 96 * 2**20
LEAST_POINTS = 256  # of a chunk


@dataclass(frozen=True)
class OccupiedRays(TensorRecord):
    """Rays with the steps that count: t_edges (R, N + 1), m, occupied (R, N), their total length (R,), m."""

    rays: RayBundle
    t_edges: Tensor
    occupied: Tensor
    length: Tensor

    @classmethod
    def of(cls, bounds: Bounds, rays: RayBundle, num_steps: int) -> "OccupiedRays":
        """Where rays (R,) may meet something, by so many steps a ray; by one through the box without a hull."""
        if bounds.hull is None:
            near, far = box_interval(rays, *bounds.tight_box)
            return cls(rays, torch.stack((near, far), dim=-1), (far > near)[:, None], far - near)
        t_edges, occupied = occupied_edges(bounds.hull, rays, num_steps, bounds.coarse_hull)
        return cls(rays, t_edges, occupied, (torch.diff(t_edges, dim=-1) * occupied).sum(-1))

    @property
    def far(self) -> Tensor:
        """Where the last step ends, (R,), m."""
        return self.t_edges[:, -1]


@dataclass(frozen=True)
class RaySamples(TensorRecord):
    """Samples of rays (R,).

    Attributes:
        s_vals: Their occupied arc length, (R, S), m, ascending.
        s_edges: Their bins, (R, S + 1), m.
        t_vals: Their distances along the rays, (R, S), m.
        points: (R, S, 3), m.
        directions: Of the rays, (R, 3), unit.
        inside: Which may have a density, (R, S), bool.
    """

    s_vals: Tensor
    s_edges: Tensor
    t_vals: Tensor
    points: Tensor
    directions: Tensor
    inside: Tensor

    @classmethod
    def at(cls, bounds: Bounds, seen: OccupiedRays, s_vals: Tensor, s_edges: Tensor) -> "RaySamples":
        """Samples at occupied arc lengths s_vals (R, S) with bins s_edges (R, S + 1)."""
        t_vals = OccupiedLength.of(seen.t_edges, seen.occupied).t_vals(s_vals)
        points = points_along(seen.rays, t_vals)
        inside = (seen.length > 0)[:, None] & bounds.may_hold(points)
        return cls(s_vals, s_edges, t_vals, points, seen.rays.directions, inside)

    @property
    def view_dirs(self) -> Tensor:
        """Along which the samples are looked at, (R, S, 3)."""
        return self.directions[:, None].expand_as(self.points)


def coarse_samples(
    bounds: Bounds, seen: OccupiedRays, num_samples: int, generator: torch.Generator | None = None
) -> RaySamples:
    """One sample in each of equal bins of the occupied length; in the middles without a generator."""
    s_vals = stratified_t_vals(torch.zeros_like(seen.length), seen.length, num_samples, generator)
    share = torch.linspace(0.0, 1.0, num_samples + 1, dtype=s_vals.dtype, device=s_vals.device)
    return RaySamples.at(bounds, seen, s_vals, seen.length[:, None] * share)


def finer_samples(
    bounds: Bounds,
    seen: OccupiedRays,
    samples: RaySamples,
    densities: Tensor,
    *,
    quadrature: AbstractQuadrature,
    num_samples: int,
    generator: torch.Generator | None = None,
) -> RaySamples:
    """The samples given and further ones, drawn where their densities (R, S) absorb the light."""
    drawn = quadrature.importance_t_vals(
        densities.detach(), samples.s_vals, samples.s_edges, num_samples, generator
    )
    s_vals = merge_t_vals(samples.s_vals, drawn)
    s_edges = edges_from_t_vals(s_vals, torch.zeros_like(seen.length), seen.length)
    return RaySamples.at(bounds, seen, s_vals, s_edges)


def points_in_memory(field: AbstractField, mib: float) -> int:
    """Points a chunk within a bound on memory."""
    return max(LEAST_POINTS, int(mib * 2**20 / field.bytes_per_point))


def points_at_once(field: AbstractField, most: int = POINTS_AT_ONCE) -> int:
    """Points a chunk that stays in the caches, where no gradient is kept."""
    return min(most, max(LEAST_POINTS, BYTES_AT_ONCE // field.bytes_per_point))


def in_chunks(field: AbstractField, points: Tensor, view_dirs: Tensor, size: int) -> FieldOutput:
    """Answers at points (P, 3) looked at along view_dirs (P, 3), a chunk of that size at a time."""
    parts = [field(points[i : i + size], view_dirs[i : i + size]) for i in range(0, len(points), size)]
    if not parts:
        return FieldOutput(rgb=torch.zeros_like(points), densities=torch.zeros_like(points[:, 0]))
    return FieldOutput.joined(parts)


def densities_inside(field: AbstractField, points: Tensor, view_dirs: Tensor, inside: Tensor) -> Tensor:
    """Densities (...), 1/m, of points (..., 3) that are inside (...), in chunks without gradient; zero elsewhere, unevaluated."""
    packed, towards, size = points[inside], view_dirs[inside], points_at_once(field)
    parts = [
        field.densities(packed[i : i + size], towards[i : i + size]).densities
        for i in range(0, len(packed), size)
    ]
    densities = points.new_zeros(inside.shape)
    if parts:
        densities[inside] = torch.cat(parts).to(densities.dtype)
    return densities
