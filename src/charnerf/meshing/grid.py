"""Values on a regular grid. Letters: X, Y, Z grid points along the axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.types import LeftOut


@dataclass(frozen=True)
class Grid:
    """Values at the points of a regular grid whose outermost layer is empty: densities, or optical depths.

    Attributes:
        values: (X, Y, Z), float32, at least 0.
        origin: World position of point (0, 0, 0), (3,), m.
        spacing: Edge of a cell, m.
        left_out: Grid points at which the field was not asked, of all.
    """

    values: np.ndarray
    origin: np.ndarray
    spacing: float
    left_out: LeftOut

    def contrast(self, level: float) -> np.ndarray:
        """The values mapped to [-1, 1], 0 at the level: a scale that runs nearly straight through a surface."""
        values = self.values.astype(np.float64)
        return (values - level) / (values + level)

    def interpolator(self, level: float, device: torch.device | str = "cpu") -> Callable[[Tensor], Tensor]:
        """The function that reads values (...) at points (..., 3), m, between the grid's; the border's beyond it.

        Interpolated as `contrast` is, so that it is most faithful where values are the level.
        """
        volume = torch.from_numpy(np.ascontiguousarray(self.values)).to(device)
        share = (volume / (volume + level))[None, None]
        corner = torch.from_numpy(self.origin).to(volume)
        extent = (torch.tensor(volume.shape) - 1).to(volume) * self.spacing

        def value_at(points: Tensor) -> Tensor:
            at = 2.0 * (points.to(volume) - corner) / extent - 1.0
            # grid_sample takes the last axis of the volume first
            flat = at.flip(-1).reshape(1, 1, 1, -1, 3)
            read = F.grid_sample(share, flat, align_corners=True, padding_mode="border")
            read = read.view(points.shape[:-1])
            return level * read / (1.0 - read).clamp_min(1e-6)

        return value_at
