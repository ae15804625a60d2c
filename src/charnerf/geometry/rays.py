"""Rays against boxes, and the coordinate that runs along the occupied part of a ray only."""

import torch
from torch import Tensor

from charnerf.types import RayBundle


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


def occupied_to_t(t_edges: Tensor, occupied: Tensor, s_vals: Tensor) -> Tensor:
    """Map arc length along the occupied steps of a ray to distance along the ray.

    Args:
        t_edges: Edges of the steps, (R, N + 1), m, ascending.
        occupied: Which steps count, (R, N), bool.
        s_vals: Occupied arc length, (R, S), m, in [0, total occupied length].

    Returns:
        t_vals, (R, S), m. A ray without occupied steps maps to its first edge.
    """
    lengths = torch.diff(t_edges, dim=-1) * occupied
    cumulated = lengths.cumsum(-1)
    last = torch.where(occupied, torch.arange(occupied.shape[-1], device=occupied.device), 0).amax(
        -1, keepdim=True
    )
    step = torch.minimum(torch.searchsorted(cumulated, s_vals.contiguous(), right=True), last)
    before = torch.gather(cumulated - lengths, -1, step)
    return torch.gather(t_edges, -1, step) + (s_vals - before).clamp_min(0.0)
