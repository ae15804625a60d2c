"""A field's densities, averaged over directions. Letters: P points; N cameras averaged over."""

from __future__ import annotations

import torch
from torch import Tensor

from charnerf.errors import DataError, NumericalError
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.geometry.framing import LEAST_DISTANCE
from charnerf.geometry.safe import safe_normalize
from charnerf.scene import Scene
from charnerf.volume.marching import densities_inside

CHUNK = 8192  # points evaluated at once; larger batches leave the caches


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
