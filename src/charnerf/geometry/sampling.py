"""Where samples stand along a ray.

Naming contract: `t_vals` (..., S) are sample distances, ascending; `t_edges` (..., S+1) bound the S bins
that the samples stand for, t_edges[i] <= t_vals[i] <= t_edges[i+1]; `weights` (..., S) belong to bins.
Metres along unit directions. A generator makes draws random; without one they are the deterministic
midpoints of equal shares.
"""

import torch
from torch import Tensor

from charnerf.checks import check_last_dim
from charnerf.errors import ShapeError
from charnerf.geometry.safe import full_precision


def _check_num_samples(num_samples: int) -> None:
    if num_samples < 1:
        raise ValueError(f"num_samples: found {num_samples}, expected at least 1.")


def stratified_numbers(like: Tensor, shape: tuple[int, ...], generator: torch.Generator | None) -> Tensor:
    """One number in each of shape[-1] equal shares of [0, 1], ascending, (*shape).

    Args:
        like: Tensor that gives dtype and device.
        shape: Shape of the result.
        generator: Jitters each number within its share (it may live on another device); None gives the
            midpoints.
    """
    count = shape[-1]
    index = torch.arange(count, dtype=like.dtype, device=like.device)
    if generator is None:
        return ((index + 0.5) / count).expand(shape)
    jitter = torch.rand(shape, generator=generator, dtype=like.dtype, device=generator.device).to(like.device)
    return (index + jitter) / count


def stratified_t_vals(
    near: Tensor, far: Tensor, num_samples: int, generator: torch.Generator | None = None
) -> Tensor:
    """Draw one sample in each of num_samples equal bins of [near, far].

    Args:
        near: Start, (...), m.
        far: End, (...), m, not below near.
        num_samples: S, at least 1.
        generator: Jitters within the bins; None gives their midpoints.

    Returns:
        t_vals, (..., S), ascending, within [near, far].

    Raises:
        ValueError: If num_samples is below 1.

    Source: NeRF (Mildenhall 2020), eq. 2.
    """
    _check_num_samples(num_samples)
    near, far = torch.broadcast_tensors(full_precision(near)[..., None], full_precision(far)[..., None])
    share = stratified_numbers(near, (*near.shape[:-1], num_samples), generator)
    return torch.minimum(near + (far - near) * share, far)  # this form stays ascending under rounding


def edges_from_t_vals(t_vals: Tensor, near: Tensor, far: Tensor) -> Tensor:
    """Bin edges around samples: near, the midpoints between neighbours, far.

    Args:
        t_vals: (..., S), ascending, m.
        near: (...), m, not above the first sample.
        far: (...), m, not below the last sample.

    Returns:
        t_edges, (..., S+1).
    """
    t_vals, near, far = full_precision(t_vals), full_precision(near), full_precision(far)
    middle = 0.5 * t_vals[..., 1:] + 0.5 * t_vals[..., :-1]
    ends = t_vals.shape[:-1]
    return torch.cat((near.expand(ends)[..., None], middle, far.expand(ends)[..., None]), dim=-1)


def merge_t_vals(first: Tensor, second: Tensor) -> Tensor:
    """Merge two sets of samples of the same rays, (..., S) and (..., N), into one, (..., S+N), ascending."""
    return torch.cat((first, second), dim=-1).sort(dim=-1).values


def usable_weights(weights: Tensor, widths: Tensor) -> Tensor:
    """Histogram weights scaled to a largest of 1, uniform in t for rays that have none.

    Args:
        weights: (..., S); negative ones count as zero.
        widths: Bin widths, (..., S), that the uniform distribution is made of.

    Returns:
        (..., S), finite, in [0, 1], not all zero in any ray.
    """
    largest = weights.clamp_min(0.0).amax(dim=-1, keepdim=True)  # NaN and infinity stay
    is_good = weights.isfinite().all(dim=-1, keepdim=True) & (largest > 0.0)
    total_width = widths.amax(dim=-1, keepdim=True)
    uniform = torch.where(total_width > 0.0, widths / torch.where(total_width > 0.0, total_width, 1.0), 1.0)
    return torch.where(is_good, weights.clamp_min(0.0) / torch.where(is_good, largest, 1.0), uniform)


def draw_bins(masses: Tensor, num_samples: int, generator: torch.Generator | None) -> tuple[Tensor, Tensor]:
    """Invert the CDF of a histogram for equal shares of its mass.

    Args:
        masses: (..., S), finite, non-negative, not all zero, of any common scale.
        num_samples: Draws.
        generator: Jitters the shares; None takes their midpoints.

    Returns:
        Bins (..., num_samples), int64, ascending, never one without mass; and the share of the bin's own
        mass that lies before each draw, in [0, 1].
    """
    has_mass = masses > 0.0
    # A parallel scan is not monotone to the last bit: bins without mass take exactly the value before them.
    cdf = torch.where(has_mass, masses.cumsum(dim=-1), 0.0).cummax(dim=-1).values
    total = cdf[..., -1:]
    target = stratified_numbers(masses, (*masses.shape[:-1], num_samples), generator) * total
    bins = torch.searchsorted(cdf, target.contiguous(), right=True)
    last = torch.searchsorted(
        cdf, total.contiguous()
    )  # a target that rounds up to the total stays in the last bin with mass
    bins = torch.minimum(bins, last)
    upper = cdf.gather(-1, bins)
    lower = torch.where(bins > 0, cdf.gather(-1, (bins - 1).clamp_min(0)), 0.0)
    share = ((target - lower) / (upper - lower)).clamp(0.0, 1.0)
    return bins, share


def importance_t_vals(
    t_edges: Tensor, weights: Tensor, num_samples: int, generator: torch.Generator | None = None
) -> Tensor:
    """Draw samples where a histogram has its weight.

    Each draw lies inside a bin of non-zero weight, edges included. Draws carry no gradient.

    Args:
        t_edges: (..., S+1), ascending, m; bins of zero width are allowed.
        weights: (..., S), of any scale. A ray whose weights are all zero, or of which one is not finite, is
            drawn uniformly.
        num_samples: Draws a ray, at least 1.
        generator: Jitters each draw within its share of the mass; None takes the midpoints of the shares.

    Returns:
        t_vals, (..., num_samples), ascending.

    Raises:
        ShapeError: If weights do not fit t_edges.
        ValueError: If num_samples is below 1.

    Source: NeRF (Mildenhall 2020), section 5.2.
    """
    _check_num_samples(num_samples)
    check_last_dim("t_edges", t_edges, weights.shape[-1] + 1)
    if t_edges.shape[:-1] != weights.shape[:-1]:
        raise ShapeError(
            f"t_edges and weights: found shapes {tuple(t_edges.shape)} and {tuple(weights.shape)}, "
            "expected the same leading shape."
        )
    t_edges, weights = full_precision(t_edges.detach()), full_precision(weights.detach())
    masses = usable_weights(weights, t_edges.diff(dim=-1)).to(t_edges.dtype)
    bins, share = draw_bins(masses, num_samples, generator)
    lower, upper = t_edges.gather(-1, bins), t_edges.gather(-1, bins + 1)
    return torch.minimum(lower + (upper - lower) * share, upper)
