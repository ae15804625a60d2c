"""Where rays may meet a hull, found coarse to fine, and bins that never straddle two of its segments.

Letters: R rays, N steps, K bins a ray. `s` is arc length along the occupied steps of a ray, m.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.geometry.rays import box_interval
from charnerf.types import Hull, RayBundle

POOL = 4  # cells of the hull a side of a coarse cell
COARSE_STEPS = (
    20  # a share of 1/16 of the ray's way through the box can not step over a dilated coarse cell of 32
)
RAYS_AT_ONCE = 4096  # more leave the caches


@dataclass(frozen=True)
class Candidates:
    """Rays that may meet something: their index (R,) among those asked, and where, near and far (R,), m."""

    index: Tensor
    near: Tensor
    far: Tensor


def coarse_occupancy(occupancy: Tensor) -> Tensor:
    """Occupied cells (G, G, G) pooled by 4 and dilated by one coarse cell, (G/4, G/4, G/4) bool."""
    side = occupancy.shape[0] // POOL
    # four bools are one int32: two reductions instead of three, on a quarter of the elements
    packed = occupancy.contiguous().view(torch.int32).view(side, POOL, side * POOL, side)
    packed = packed[:, 0] | packed[:, 1] | packed[:, 2] | packed[:, 3]
    packed = packed.view(side, side, POOL, side)
    pooled = (packed[:, :, 0] | packed[:, :, 1] | packed[:, :, 2] | packed[:, :, 3]) != 0
    for axis in range(3):
        widened = pooled.clone()
        widened.narrow(axis, 1, side - 1).logical_or_(pooled.narrow(axis, 0, side - 1))
        widened.narrow(axis, 0, side - 1).logical_or_(pooled.narrow(axis, 1, side - 1))
        pooled = widened
    return pooled


def candidates(hull: Hull, coarse: Tensor, rays: RayBundle) -> Candidates:
    """Rays (R,) that may meet the hull, and the part of each that may; conservative.

    A ray that touches an occupied coarse cell stays in the cells around it for at least 2/side of its way
    through the box, so
    that equal steps of at most that length can not miss the dilated cells.

    Args:
        hull: One character's hull.
        coarse: Its `coarse_occupancy`.
        rays: Rays (R,).
    """
    parts = [
        _candidates(coarse, hull, rays[i : i + RAYS_AT_ONCE], i)
        for i in range(0, max(1, rays.origins.shape[0]), RAYS_AT_ONCE)
    ]
    return Candidates(
        *(torch.cat([getattr(part, name) for part in parts]) for name in ("index", "near", "far"))
    )


def _candidates(coarse: Tensor, hull: Hull, rays: RayBundle, offset: int) -> Candidates:
    near, far = box_interval(rays, hull.box_min, hull.box_max)
    steps = max(COARSE_STEPS, -(-5 * coarse.shape[0] // 8))
    share = (torch.arange(steps, dtype=near.dtype, device=near.device) + 0.5) / steps
    middle = near[:, None] + (far - near)[:, None] * share
    touched = occupied_at(coarse, hull, rays, middle) & (far > near)[:, None]
    index = touched.any(-1).nonzero()[:, 0]
    touched, near, far = touched[index].to(torch.uint8), near[index], far[index]
    first, last = touched.argmax(-1), steps - 1 - touched.flip(-1).argmax(-1)
    step = (far - near) / steps
    return Candidates(
        index + offset,
        near + step * (first - 1).clamp_min(0),
        torch.minimum(near + step * (last + 2), far),
    )


def occupied_at(occupancy: Tensor, hull: Hull, rays: RayBundle, t_vals: Tensor) -> Tensor:
    """Whether points at distances t_vals (R, N) on rays (R,) lie in occupied cells of a grid over the hull's box, (R, N)."""
    cells = occupancy.shape[0]
    scale = cells / (hull.box_max - hull.box_min)
    start, slope = (rays.origins - hull.box_min) * scale, rays.directions * scale
    flat: Tensor | None = None
    for axis in range(3):
        index = (slope[:, axis, None] * t_vals).add_(start[:, axis, None]).clamp_(0, cells - 1).int()
        flat = index if flat is None else flat.mul_(cells).add_(index)
    assert flat is not None
    return occupancy.reshape(-1).index_select(0, flat.view(-1)).view(flat.shape)


def segment_bins(occupied: Tensor, lengths: Tensor, spacing: float, max_bins: int) -> tuple[Tensor, Tensor]:
    """Divide the occupied arc length of rays into bins that never straddle a gap, each at most `spacing` long.

    Args:
        occupied: Which steps count, (R, N), at least one in every ray.
        lengths: Lengths of the steps, (R, N), m.
        spacing: Longest bin, m; longer ones are made where a ray would need more than max_bins.
        max_bins: Bins of a ray, at most (more where a ray has more segments).

    Returns:
        s_edges (R, K + 1), m, rays with fewer than K bins padded by bins of no width at their end; and
        first (R, K), bool:
        whether a bin begins a segment.
    """
    counted = lengths * occupied
    total = counted.sum(-1)
    begins = occupied & ~torch.cat((torch.zeros_like(occupied[:, :1]), occupied[:, :-1]), dim=-1)
    segment = begins.cumsum(-1)  # from 1 on; the steps of a gap add nothing to the one before
    num_segments = max(1, int(segment[:, -1].max()) if len(segment) else 1)
    per_segment = counted.new_zeros(len(counted), num_segments + 1).scatter_add_(1, segment, counted)[:, 1:]
    width = torch.maximum(total / max_bins, torch.full_like(total, spacing))
    counts = (per_segment / width[:, None] - 1e-4).ceil().clamp_min(0)  # absent segments get none
    counts = torch.where(per_segment > 0, counts.clamp_min(1), counts)
    ends, s_ends = counts.cumsum(-1), per_segment.cumsum(-1)
    num_bins = max(1, int(ends[:, -1].max()) if len(ends) else 1)
    number = torch.arange(num_bins + 1, dtype=counted.dtype, device=counted.device).expand(len(counted), -1)
    at = torch.searchsorted(ends, number.contiguous(), right=True).clamp_max(num_segments - 1)
    begin = (ends - counts).gather(-1, at)
    share = ((number - begin) / counts.gather(-1, at).clamp_min(1)).clamp_max(1)
    s_edges = (s_ends - per_segment).gather(-1, at) + per_segment.gather(-1, at) * share
    return s_edges.cummax(-1).values, (number == begin)[:, :-1]
