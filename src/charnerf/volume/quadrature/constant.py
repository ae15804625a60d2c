"""Piecewise constant density (NeRF)."""

from typing import final

import torch
from torch import Tensor

from charnerf.geometry.sampling import importance_t_vals
from charnerf.volume.compositing import weights_from_densities
from charnerf.volume.quadrature.base import AbstractQuadrature


@final
class PiecewiseConstant(AbstractQuadrature):
    """Each bin has the density of its sample.

    Exact for constant density. On smooth densities the error falls with the square of the spacing where the
    edges are midpoints between the samples, or the samples midpoints of the bins. Draws are uniform within a
    bin.

    Source: NeRF (Mildenhall 2020), eq. 3; Max 1995.
    """

    def weights(self, densities: Tensor, t_vals: Tensor, t_edges: Tensor) -> tuple[Tensor, Tensor]:
        """As the base says; the positions of the samples within their bins do not matter."""
        return weights_from_densities(densities, torch.diff(t_edges, dim=-1))

    def importance_t_vals(
        self,
        densities: Tensor,
        t_vals: Tensor,
        t_edges: Tensor,
        num_samples: int,
        generator: torch.Generator | None = None,
    ) -> Tensor:
        """As the base says, by the histogram of the weights."""
        weights, _ = self.weights(densities.detach(), t_vals, t_edges.detach())
        return importance_t_vals(t_edges, weights, num_samples, generator)
