"""What a quadrature answers."""

from abc import ABC, abstractmethod

import torch
from torch import Tensor


class AbstractQuadrature(ABC):
    """Turns densities at samples into weights of samples, and weights into new samples.

    The coordinate t is any continuous length along the ray: distance from the origin, or arc length along
    the occupied part of it where a hull leaves gaps out. Each sample lies within its bin, t_edges[i] <=
    t_vals[i] <= t_edges[i+1]; bins of zero width are allowed. Tensors may be float32 or float64; half
    precisions are computed and returned in float32.
    """

    @abstractmethod
    def weights(self, densities: Tensor, t_vals: Tensor, t_edges: Tensor) -> tuple[Tensor, Tensor]:
        """Share of light absorbed in each sample's bin, and what passes all of them.

        Args:
            densities: At the samples, (..., S), 1/m, non-negative, finite.
            t_vals: (..., S), ascending, m.
            t_edges: Bins of the samples, (..., S+1), ascending, m.

        Returns:
            Weights (..., S) and final transmittance (...); they sum to 1 to rounding.
        """

    @abstractmethod
    def importance_t_vals(
        self,
        densities: Tensor,
        t_vals: Tensor,
        t_edges: Tensor,
        num_samples: int,
        generator: torch.Generator | None = None,
    ) -> Tensor:
        """Draw samples where the light is absorbed; draws carry no gradient.

        Args:
            densities: At the samples, (..., S), 1/m. A ray that absorbs nothing, or with one that is not
                finite, is drawn uniformly.
            t_vals: (..., S), ascending, m.
            t_edges: (..., S+1), ascending, m.
            num_samples: Draws a ray, at least 1.
            generator: Jitters each draw within its share of the mass; None takes the midpoints of the shares.

        Returns:
            t_vals, (..., num_samples), ascending.
        """
