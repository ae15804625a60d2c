"""A field's densities: averaged over directions, and on a regular grid.

Letters: P points; N cameras averaged over; X, Y, Z grid points along the axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.errors import DataError, NumericalError
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.geometry.framing import LEAST_DISTANCE
from charnerf.geometry.safe import safe_normalize
from charnerf.scene import Scene
from charnerf.types import LeftOut
from charnerf.volume.marching import densities_inside

CHUNK = 8192  # points evaluated at once; larger batches leave the caches
MIDDLE_LEVEL = 20.0  # 1/m; where interpolation between grid points is most faithful


@dataclass(frozen=True)
class DensityGrid:
    """Densities at the points of a regular grid whose outermost layer is empty.

    Attributes:
        densities: (X, Y, Z), float32, 1/m, zero outside the hull. Blocks that carry no surface hold values
            interpolated from their corners.
        origin: World position of point (0, 0, 0), (3,), m.
        spacing: Edge of a cell, m.
        left_out: Grid points that were not evaluated, of all.
    """

    densities: np.ndarray
    origin: np.ndarray
    spacing: float
    left_out: LeftOut

    def interpolator(self, device: torch.device | str = "cpu") -> Callable[[Tensor], Tensor]:
        """The function that reads densities (...) at points (..., 3), m, between the grid's; the border's beyond it.

        Interpolated in a scale that runs nearly straight through a surface, as density itself does not.
        """
        volume = torch.from_numpy(np.ascontiguousarray(self.densities)).to(device)
        contrast = (volume / (volume + MIDDLE_LEVEL))[None, None]
        corner = torch.from_numpy(self.origin).to(volume)
        extent = (torch.tensor(volume.shape) - 1).to(volume) * self.spacing

        def density_at(points: Tensor) -> Tensor:
            at = 2.0 * (points.to(volume) - corner) / extent - 1.0
            # grid_sample takes the last axis of the volume first
            flat = at.flip(-1).reshape(1, 1, 1, -1, 3)
            read = F.grid_sample(contrast, flat, align_corners=True, padding_mode="border")
            read = read.view(points.shape[:-1])
            return MIDDLE_LEVEL * read / (1.0 - read).clamp_min(1e-6)

        return density_at


def averaged_density(scene: Scene, points: Tensor, num_cameras: int) -> Tensor:
    """Density averaged over cameras around the character.

    Args:
        scene: One character's field.
        points: (P, 3), m.
        num_cameras: N, cameras on the upper hemisphere whose directions are averaged over. Where the density
            sees no direction one evaluation (with the zero direction) says all.

    Returns:
        Densities (P,), 1/m; zero outside the hull, where nothing is evaluated.

    Raises:
        NumericalError: If the field answers NaN or infinity.

    Source: paper, Mesh Reconstruction (several cameras, averaged, instead of the zero direction).
    """
    view_dirs = [torch.zeros_like(points)]
    if scene.field.sees_directions:
        positions = camera_positions(scene, num_cameras).to(points)
        view_dirs = [safe_normalize(points - position) for position in positions]
    inside = scene.bounds.may_hold(points)
    answers = [densities_inside(scene.field, points, dirs, inside) for dirs in view_dirs]
    densities = torch.stack(answers).mean(0)
    if not bool(densities.isfinite().all()):
        bad = int((~densities.isfinite()).sum())
        raise NumericalError(
            f"density field: found {bad} of {densities.numel()} values not finite, expected finite "
            "densities. "
            "The weights are broken: load another checkpoint."
        )
    return densities


def camera_positions(scene: Scene, num_cameras: int) -> Tensor:
    """Where the averaged cameras stand, (N, 3), m."""
    if num_cameras < 1:
        raise DataError(f"num_cameras: found {num_cameras}, expected at least 1.")
    centre = 0.5 * (scene.bounds.box_min + scene.bounds.box_max)
    return centre + LEAST_DISTANCE * fibonacci_hemisphere(num_cameras).to(centre)
