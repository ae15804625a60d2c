"""Error of a ray's colour, estimated bin by bin, and bins split where it is made.

Letters: R rays, K bins a ray, sample k at the centre of bin k, padded by bins of no width. The estimate is
goal-oriented (dual
weighted): what an error of a bin's optical depth does to the colour of the ray is the light that reaches
the bin times the
difference of the bin's colour from the light behind it.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.types import FieldOutput
from charnerf.volume.compositing import composite, weights_from_optical_depths
from charnerf.volume.marching import RaySamples
from charnerf.volume.quadrature.base import AbstractQuadrature

DENSITY_SHARE = 0.3  # of the jump to a neighbour's density, taken as the error of a bin's mean density
THIRDS_SHARE = 0.25  # of what every third of equal bins differs by, taken as the error of all of them
# of the bound of equal bins, which is several times what fields read from drawings make
BOUND_SHARE = 1.0 / 3.0
COLOR_SHARE = 0.2  # of the difference to a neighbour's colour, taken as the error of a bin's colour


@dataclass(frozen=True)
class Marched:
    """Rays composited: colour (R, 3), opacity (R,), weights (R, K), errors of the bins (R, K) and what is left behind (R,)."""

    rgb: Tensor
    opacity: Tensor
    weights: Tensor
    errors: Tensor
    unseen: Tensor


def light_before(depths: Tensor) -> tuple[Tensor, Tensor]:
    """Light before and after bins of optical depths (R, K), in [0, 1]."""
    after = depths.cumsum(-1)
    return torch.exp(depths - after), torch.exp(-after)


def heavy_weights(weights: Tensor, budget: float) -> Tensor:
    """The fewest weights (R, K) that leave out no more than a budget of light in each ray, (R, K) bool."""
    ascending = weights.sort(dim=-1).values
    light = ascending.cumsum(-1) <= budget
    first = light.sum(-1, keepdim=True).clamp_max(weights.shape[-1] - 1)
    return (weights >= ascending.gather(-1, first)) & (weights > 0) & ~light.all(-1, keepdim=True)


def march(
    densities: Tensor, rgb: Tensor, colored: Tensor, widths: Tensor, begins: Tensor, background: float
) -> Marched:
    """Composite rays and estimate the error that each bin makes.

    Args:
        densities: (R, K), 1/m.
        rgb: Colours (R, K, 3), read only where `colored`.
        colored: Bins whose colour was evaluated, (R, K), bool; the light absorbed in the others counts as
            having the mean colour
            of the colored ones, and is added to the estimate.
        widths: Of the bins, (R, K), m; 0 pads.
        begins: Bins that begin a segment of the hull, (R, K): before them the density is another one for a
            plain reason.
        background: Colour behind everything.
    """
    depths = densities * widths
    weights, passed = weights_from_optical_depths(depths)
    seen = (weights * colored)[..., None] * rgb
    shown, opacity = seen.sum(1), weights.sum(-1)
    counted = (weights * colored).sum(-1)
    unseen = opacity - counted
    total = shown * (opacity / counted.clamp_min(1e-6))[:, None] + background * passed[:, None]
    before, after = light_before(depths)
    behind = ((total[:, None] - seen.cumsum(1)) / after[..., None].clamp_min(1e-4)).clamp(0.0, 1.0)
    contrast = torch.where(colored, (rgb - behind).abs().amax(-1), 1.0)
    joined = (widths[:, 1:] > 0) & ~begins[:, 1:]  # bin k with k + 1
    jump = _largest_step((densities[:, 1:] - densities[:, :-1]).abs() * joined)
    alone = ~(_either_side(joined))
    jump = torch.where(alone, densities, jump)
    from_density = (before * after).sqrt() * contrast * (DENSITY_SHARE * jump * widths).clamp_max(1.0)
    step = (rgb[:, 1:] - rgb[:, :-1]).abs().amax(-1) * (joined & colored[:, 1:] & colored[:, :-1])
    from_color = COLOR_SHARE * weights * _largest_step(step)
    return Marched(
        rgb=total, opacity=opacity, weights=weights, errors=from_density + from_color, unseen=unseen
    )


def _largest_step(steps: Tensor) -> Tensor:
    """Larger of the steps (R, K - 1) on the two sides of each of K bins."""
    padded = torch.nn.functional.pad(steps, (1, 1))
    return torch.maximum(padded[:, :-1], padded[:, 1:])


def _either_side(joined: Tensor) -> Tensor:
    padded = torch.nn.functional.pad(joined, (1, 1))
    return padded[:, :-1] | padded[:, 1:]


def error_of_equal_bins(
    quadrature: AbstractQuadrature, answer: FieldOutput, samples: RaySamples, rgb: Tensor, background: float
) -> Tensor:
    """Error (R,) of the colours of rays in equal bins, a multiple of three: the larger of two estimates.

    What every third sample alone would say, by three rules of bins three times as wide: where a density jumps, two of three times
    one of them is two bins off, and the error at most half a bin. And a share of the bound that `march` estimates bin by bin,
    which sees the remaining jumps.

    Args:
        quadrature: By which the colours were composited.
        answer: The field's, at the samples (R, S).
        samples: The samples, S a multiple of three.
        rgb: Colours by all of them, (R, 3).
        background: Colour behind everything.
    """
    s_edges, behind = samples.s_edges[:, ::3], rgb.new_tensor(background)
    off = torch.zeros_like(rgb)
    for first in range(3):
        weights, _ = quadrature.weights(answer.densities[:, first::3], samples.s_vals[:, first::3], s_edges)
        off = torch.maximum(off, (composite(weights, answer.rgb[:, first::3], behind) - rgb).abs())
    begins = torch.zeros_like(samples.inside)
    begins[:, 0] = True
    widths = samples.s_edges.diff(dim=-1)
    bound = march(answer.densities, answer.rgb, samples.inside, widths, begins, background).errors
    return torch.maximum(THIRDS_SHARE * off.amax(-1), BOUND_SHARE * bound.square().sum(-1).sqrt())


@dataclass(frozen=True)
class Split:
    """Bins after splitting: s_edges (R, K' + 1), begins (R, K'), where each bin's sample was before (R, K'), -1 for new ones."""

    s_edges: Tensor
    begins: Tensor
    source: Tensor


def split_bins(s_edges: Tensor, begins: Tensor, errors: Tensor, num_split: int, least: float) -> Split:
    """Cut the bins with the largest errors into three: the sample in the middle stays the middle of its bin.

    Args:
        s_edges: (R, K + 1), m.
        begins: (R, K), bool.
        errors: (R, K).
        num_split: Bins cut a ray, at most.
        least: Bins with a smaller error are not cut.
    """
    num_bins = errors.shape[-1]
    values, chosen = errors.topk(min(num_split, num_bins), dim=-1)
    cut = torch.zeros_like(begins).scatter(1, chosen, values > least)
    pieces = torch.where(cut, 3, 1)
    ends = pieces.cumsum(-1)
    count = int(ends[:, -1].max())
    number = torch.arange(count, device=ends.device).expand(len(ends), -1).contiguous()
    parent = torch.searchsorted(ends, number, right=True)
    beyond = parent >= num_bins
    parent = parent.clamp_max(num_bins - 1)
    piece = number - (ends - pieces).gather(1, parent)
    low, high = s_edges.gather(1, parent), s_edges.gather(1, parent + 1)
    num_pieces = pieces.gather(1, parent)
    start = torch.where(beyond, high, low + (high - low) * (piece / num_pieces))
    edges = torch.cat((start, s_edges[:, -1:]), dim=-1)
    middle = ~beyond & ((num_pieces == 1) | (piece == 1))
    return Split(
        s_edges=edges,
        begins=begins.gather(1, parent) & (piece == 0) & ~beyond,
        source=torch.where(middle, parent, -1),
    )
