"""Density activations: from a network's raw output to densities in 1/m, never negative.

Densities scale as 1 / length: a scene in other units than metres multiplies `scale` by its units a metre's
inverse, and then starts at the same opacity and trains the same (Alpha Invariance, 2024). Half precisions
are computed and returned in float32.
"""

from typing import final

import torch
from torch import Tensor, nn

from charnerf.geometry.safe import full_precision


@final
class ReLU(nn.Module):
    """density = scale * max(raw, 0).

    Finite for any raw up to the largest float / scale. Gradient: scale where raw > 0, else 0, so that a
    field whose raw output is negative everywhere (a picture all white) receives no gradient and never
    recovers.
    """

    def __init__(self, *, scale: float) -> None:
        super().__init__()
        self.scale = scale

    def forward(self, raw: Tensor) -> Tensor:
        """Turn raw outputs (...) into densities (...), 1/m."""
        return self.scale * torch.relu(full_precision(raw))


@final
class ShiftedSoftplus(nn.Module):
    """density = scale * softplus(raw + shift).

    Finite for any raw up to the largest float / scale. Gradient: scale * sigmoid(raw + shift), within (0,
    scale], positive until it underflows at raw + shift of about -100: no field is dead.
    """

    def __init__(self, *, shift: float, scale: float) -> None:
        super().__init__()
        self.shift = shift
        self.scale = scale

    def forward(self, raw: Tensor) -> Tensor:
        """Turn raw outputs (...) into densities (...), 1/m."""
        return self.scale * nn.functional.softplus(full_precision(raw) + self.shift)


@final
class TruncatedExp(nn.Module):
    """density = scale * exp(raw + shift) up to raw + shift = limit, beyond it the tangent.

    The plain exponential is infinite from 89 on and NaN in a weight soon after; the tangent keeps value and
    slope continuous and finite. Gradient: equal to the density up to scale * exp(limit), its largest value;
    it fades with the density where that is small.
    """

    def __init__(self, *, shift: float, scale: float, limit: float) -> None:
        super().__init__()
        self.shift = shift
        self.scale = scale
        self.limit = limit

    def forward(self, raw: Tensor) -> Tensor:
        """Turn raw outputs (...) into densities (...), 1/m."""
        exponent = full_precision(raw) + self.shift
        return (
            self.scale * torch.exp(exponent.clamp_max(self.limit)) * (1.0 + torch.relu(exponent - self.limit))
        )
