"""Values on a regular grid. Letters: X, Y, Z grid points along the axes; R rays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.geometry.cameras import pixel_rays
from charnerf.geometry.rays import box_interval
from charnerf.types import Cameras, LeftOut, RayBundle


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

    def box(self) -> tuple[Tensor, Tensor]:
        """The first point and the size of what the grid covers, (3,) float32 each, m."""
        return torch.from_numpy(self.origin).float(), (torch.tensor(self.values.shape) - 1) * self.spacing

    def rays_through(self, camera: Cameras, pixels: Tensor) -> tuple[RayBundle, Tensor, Tensor]:
        """Rays of pixels (R, 2), and where they enter and leave the grid, (R,) each, m; the same where one misses it."""
        rays, (corner, extent) = pixel_rays(camera, pixels), self.box()
        return rays, *box_interval(rays, corner.to(rays.origins), (corner + extent).to(rays.origins))

    def interpolator(self, level: float) -> Callable[[Tensor], Tensor]:
        """The function that reads values (...) at points (..., 3), m, between the grid's; the border's beyond it.

        Interpolated as `contrast` is, so that it is most faithful where values are the level.
        """
        volume, (corner, extent) = torch.from_numpy(np.ascontiguousarray(self.values)), self.box()
        share = (volume / (volume + level))[None, None]

        def value_at(points: Tensor) -> Tensor:
            at = 2.0 * (points.to(volume) - corner) / extent - 1.0
            # grid_sample takes the last axis of the volume first
            flat = at.flip(-1).reshape(1, 1, 1, -1, 3)
            read = F.grid_sample(share, flat, align_corners=True, padding_mode="border")
            read = read.view(points.shape[:-1])
            return level * read / (1.0 - read).clamp_min(1e-6)

        return value_at
