"""Rays against boxes, and the coordinate that runs along the occupied part of a ray only."""

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.types import RayBundle, TensorRecord


def points_along(rays: RayBundle, t_vals: Tensor) -> Tensor:
    """Points (..., S, 3) at distances t_vals (..., S), m, along rays (...)."""
    return rays.origins[..., None, :] + t_vals[..., None] * rays.directions[..., None, :]


def box_interval(rays: RayBundle, box_min: Tensor, box_max: Tensor) -> tuple[Tensor, Tensor]:
    """Where rays are inside an axis-aligned box, by the slab method.

    Args:
        rays: Rays (...).
        box_min: Lower corner, (3,), m.
        box_max: Upper corner, (3,), m.

    Returns:
        near and far, (...), m, near >= 0; a ray that misses has near == far (finite).
    """
    # slopes below the smallest normal number have no finite inverse and move no ray that fits into the dtype
    parallel = rays.directions.abs() < 4.0 * torch.finfo(rays.directions.dtype).tiny
    inverse = 1.0 / torch.where(parallel, torch.ones_like(rays.directions), rays.directions)
    first, second = (box_min - rays.origins) * inverse, (box_max - rays.origins) * inverse
    inside = (rays.origins >= box_min) & (rays.origins <= box_max)
    infinity = torch.full_like(first, torch.inf)
    entry = torch.where(
        parallel, torch.where(inside, -infinity, infinity), torch.minimum(first, second)
    ).amax(-1)
    leave = torch.where(
        parallel, torch.where(inside, infinity, -infinity), torch.maximum(first, second)
    ).amin(-1)
    near = entry.clamp_min(0.0)
    hit = leave > near
    zero = torch.zeros_like(near)
    return torch.where(hit, near, zero), torch.where(hit, leave, zero)


@dataclass(frozen=True)
class OccupiedLength(TensorRecord):
    """The coordinate `s` that runs along the occupied steps of rays only, from 0 to their total length, m.

    Attributes:
        t_starts: Where each step begins, (R, N), m along the ray.
        s_starts: Occupied length before each step, (R, N), m.
        s_ends: Occupied length up to the end of each, (R, N), m.
        last: The last occupied step, (R, 1).
    """

    t_starts: Tensor
    s_starts: Tensor
    s_ends: Tensor
    last: Tensor

    @classmethod
    def of(cls, t_edges: Tensor, occupied: Tensor) -> "OccupiedLength":
        """The coordinate of rays whose steps have edges t_edges (R, N + 1), m, ascending; which count, occupied (R, N)."""
        lengths = torch.diff(t_edges, dim=-1) * occupied
        ends = lengths.cumsum(-1)
        steps = torch.arange(occupied.shape[-1], device=occupied.device)
        last = torch.where(occupied, steps, 0).amax(-1, keepdim=True)
        return cls(t_edges[:, :-1], ends - lengths, ends, last)

    def t_vals(self, s_vals: Tensor) -> Tensor:
        """Distances (R, S), m, along the rays of occupied lengths s_vals (R, S), m; of a ray without any, its start."""
        step = torch.minimum(torch.searchsorted(self.s_ends, s_vals.contiguous(), right=True), self.last)
        return torch.gather(self.t_starts, -1, step) + (
            s_vals - torch.gather(self.s_starts, -1, step)
        ).clamp_min(0.0)
