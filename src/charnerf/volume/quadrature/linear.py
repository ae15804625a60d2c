"""Piecewise linear density, in closed form."""

from typing import final

import torch
from torch import Tensor

from charnerf.geometry.safe import full_precision
from charnerf.geometry.sampling import draw_bins, usable_weights
from charnerf.volume.compositing import weights_from_optical_depths
from charnerf.volume.quadrature.base import AbstractQuadrature

_LARGEST_DEPTH = 1e30  # optical depths beyond are opaque all the same; their ratios must stay finite


@final
class PiecewiseLinear(AbstractQuadrature):
    """The density is linear between the samples, and constant before the first and after the last.

    The optical depth of a bin is the exact integral of that density over it, so that moving an edge or
    adding a sample on the line changes nothing. Exact for linear density between the first sample and the
    last; the error on smooth densities falls with the square of the spacing. Draws invert the continuous CDF
    exactly.

    Source: "NeRF Revisited: Fixing Quadrature Instability in Volume Rendering" (Uy 2023), eqs. 7 to 12; here
        the colour of a
    sample counts on both sides of it, up to its bin's edges, instead of up to the next sample.
    """

    def weights(self, densities: Tensor, t_vals: Tensor, t_edges: Tensor) -> tuple[Tensor, Tensor]:
        """As the base says."""
        pieces = _piece_depths(*_knots(densities, t_vals, t_edges))  # (..., 2S)
        return weights_from_optical_depths(pieces.unflatten(-1, (-1, 2)).sum(dim=-1))

    def importance_t_vals(
        self,
        densities: Tensor,
        t_vals: Tensor,
        t_edges: Tensor,
        num_samples: int,
        generator: torch.Generator | None = None,
    ) -> Tensor:
        """As the base says, by the inverse of the continuous CDF."""
        knots, values = _knots(densities.detach(), t_vals.detach(), t_edges.detach())
        depths = _piece_depths(knots, values)
        weights, _ = weights_from_optical_depths(depths)
        lengths = torch.diff(knots, dim=-1)
        is_good = weights.isfinite().all(dim=-1, keepdim=True) & (weights.amax(dim=-1, keepdim=True) > 0.0)
        pieces, share = draw_bins(usable_weights(weights, lengths), num_samples, generator)
        start, length = knots.gather(-1, pieces), lengths.gather(-1, pieces)
        first = (values[..., :-1].gather(-1, pieces) * length).clamp_max(_LARGEST_DEPTH)
        second = (values[..., 1:].gather(-1, pieces) * length).clamp_max(_LARGEST_DEPTH)
        within = torch.where(is_good, _invert_piece(first, second, share), share)
        return torch.minimum(start + within * length, knots.gather(-1, pieces + 1))


def _knots(densities: Tensor, t_vals: Tensor, t_edges: Tensor) -> tuple[Tensor, Tensor]:
    """Positions and densities, (..., 2S+1), of edges and samples in turn: edge, sample, edge, ..., edge."""
    densities, t_vals, t_edges = full_precision(densities), full_precision(t_vals), full_precision(t_edges)
    gap = torch.diff(t_vals, dim=-1)
    is_open = gap > 0.0
    share = torch.where(
        is_open, (t_edges[..., 1:-1] - t_vals[..., :-1]) / torch.where(is_open, gap, 1.0), 0.5
    )
    middle = densities[..., :-1] * (1.0 - share) + densities[..., 1:] * share
    at_edges = torch.cat((densities[..., :1], middle), dim=-1)
    knots = torch.stack((t_edges[..., :-1], t_vals), dim=-1).flatten(-2)
    values = torch.stack((at_edges, densities), dim=-1).flatten(-2)
    return torch.cat((knots, t_edges[..., -1:]), dim=-1), torch.cat((values, densities[..., -1:]), dim=-1)


def _piece_depths(knots: Tensor, values: Tensor) -> Tensor:
    """Optical depths (..., N) of linear pieces between knots (..., N+1)."""
    return torch.diff(knots, dim=-1) * (0.5 * values[..., 1:] + 0.5 * values[..., :-1])


def _invert_piece(first: Tensor, second: Tensor, share: Tensor) -> Tensor:
    """Position in [0, 1] within a linear piece before which a share of its absorbed light is absorbed.

    Solves a x + (b - a) x^2 / 2 = tau for the optical depth tau of that share, where a and b are density
    times length at the ends; in the form without cancellation, scaled by the larger of a and b.
    """
    alpha = -torch.expm1(-0.5 * (first + second))
    tau = -torch.log1p(-share * alpha)  # infinite at a full share of an opaque piece: cut below
    largest = torch.maximum(first, second)
    scale = torch.where(largest > 0.0, largest, 1.0)
    a, b, depth = first / scale, second / scale, torch.minimum(tau, 0.5 * (first + second)) / scale
    root = (a * a + 2.0 * (b - a) * depth).clamp_min(0.0).sqrt()
    return torch.where(largest > 0.0, 2.0 * depth / torch.where(a + root > 0.0, a + root, 1.0), share).clamp(
        0.0, 1.0
    )
