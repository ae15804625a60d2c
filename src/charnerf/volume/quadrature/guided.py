"""Piecewise constant density; some of the new samples stand around the expected depth (pixelNeRF)."""

from typing import final

import torch
from torch import Tensor

from charnerf.errors import ConfigError
from charnerf.geometry.sampling import merge_t_vals, stratified_numbers, usable_weights
from charnerf.volume.quadrature.base import AbstractQuadrature
from charnerf.volume.quadrature.constant import PiecewiseConstant


@final
class DepthGuided(AbstractQuadrature):
    """Weights as the piecewise constant rule; a share of the draws is normal around the ray's expected depth.

    The depth is that of the seen part, so that a ray which shows little is not drawn at its start, and draws carry no
    gradient; both are otherwise in pixelNeRF's code. Without a generator the draws are quantiles.

    Args:
        share: Of the draws that stand around the depth, in [0, 1].
        deviation: Standard deviation of those, m.

    Source: pixelNeRF (Yu 2021): 16 of 32 fine samples, 0.01 units.
    """

    def __init__(self, *, share: float, deviation: float) -> None:
        if not 0.0 <= share <= 1.0 or not deviation > 0.0:
            raise ConfigError(
                f"quadrature: found share={share} and deviation={deviation}, expected a share in [0, 1] and a deviation"
                " above 0 m."
            )
        self.share = share
        self.deviation = deviation
        self._constant = PiecewiseConstant()

    def weights(self, densities: Tensor, t_vals: Tensor, t_edges: Tensor) -> tuple[Tensor, Tensor]:
        """As the piecewise constant rule."""
        return self._constant.weights(densities, t_vals, t_edges)

    def importance_t_vals(
        self,
        densities: Tensor,
        t_vals: Tensor,
        t_edges: Tensor,
        num_samples: int,
        generator: torch.Generator | None = None,
    ) -> Tensor:
        """Draw by the weights, and around the depth; all within the edges."""
        num_guided = round(self.share * num_samples)
        parts = []
        if num_guided < num_samples:
            drawn = num_samples - num_guided
            parts.append(self._constant.importance_t_vals(densities, t_vals, t_edges, drawn, generator))
        if num_guided:
            parts.append(self._around_depth(densities, t_vals, t_edges, num_guided, generator))
        return parts[0] if len(parts) == 1 else merge_t_vals(*parts)

    def _around_depth(
        self,
        densities: Tensor,
        t_vals: Tensor,
        t_edges: Tensor,
        num_samples: int,
        generator: torch.Generator | None,
    ) -> Tensor:
        t_vals, t_edges = t_vals.detach(), t_edges.detach()
        weights = usable_weights(self.weights(densities.detach(), t_vals, t_edges)[0], t_edges.diff(dim=-1))
        depth = (weights * t_vals).sum(-1, keepdim=True) / weights.sum(-1, keepdim=True)
        numbers = stratified_numbers(depth, (*depth.shape[:-1], num_samples), generator).clamp(
            1e-6, 1.0 - 1e-6
        )
        drawn = depth + self.deviation * torch.special.ndtri(numbers)
        return torch.minimum(torch.maximum(drawn, t_edges[..., :1]), t_edges[..., -1:])
