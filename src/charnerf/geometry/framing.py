"""How pictures frame a character: one rule for captures, drawings and renderings.

A model knows pictures that are framed so; drawings or cameras by another rule would be reconstructed wrong, without an error.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.geometry.world import CENTRE, HEIGHT
from charnerf.types import Cameras

SOURCE_AZIMUTHS = {"front": 0.0, "side": 90.0, "back": 180.0}  # degrees; the drawings, in their order
SOURCE_ORDER = tuple(SOURCE_AZIMUTHS)
MARGIN = 1.05  # of what a picture frames over the character's farthest point
LEAST_DISTANCE = 4.0  # metres, of a camera from the centre


def framing_radius(reach: float) -> float:
    """Radius of the sphere around CENTRE that pictures of a character frame, m.

    Args:
        reach: Distance of the character's farthest point from CENTRE, m; half its height, if it is less.
    """
    return MARGIN * max(0.5 * HEIGHT, reach)


def camera_distance(radius: float) -> float:
    """Distance of a camera that frames a sphere of a radius from its centre, m."""
    return max(LEAST_DISTANCE, 2.5 * radius)


def framing_cameras(directions: Tensor, *, radius: float, size: int, orthographic: bool = False) -> Cameras:
    """Square cameras that frame a sphere around CENTRE.

    Args:
        directions: Unit vectors from CENTRE to the cameras, (..., 3).
        radius: Of the sphere, m, from `framing_radius`.
        size: Side of the pictures, pixels.
        orthographic: Parallel projection instead of a pinhole.

    Returns:
        Cameras of shape (...), of the directions' type.
    """
    return cameras_towards(
        directions,
        target=directions.new_tensor(CENTRE),
        distance=camera_distance(radius),
        half_extent=radius,
        size=size,
        orthographic=orthographic,
    )


def framing_camera(azimuth_deg: float, elevation_deg: float, *, radius: float, size: int) -> Cameras:
    """Pinhole of shape (), float32, as `framing_cameras`, at an azimuth and an elevation."""
    azimuth, elevation = torch.tensor((azimuth_deg, elevation_deg), dtype=torch.float64)
    direction = direction_from_angles(azimuth, elevation)
    return framing_cameras(direction, radius=radius, size=size).to(torch.float32)


def source_cameras(
    *,
    radius: float,
    size: int,
    orthographic: bool = True,
    azimuths_deg: Sequence[float] = tuple(SOURCE_AZIMUTHS.values()),
) -> Cameras:
    """The drawings' cameras (V,), float64, as `framing_cameras`: level, at azimuths; front, side and back if not given."""
    azimuths = torch.tensor(tuple(azimuths_deg), dtype=torch.float64)
    directions = direction_from_angles(azimuths, torch.zeros_like(azimuths))
    return framing_cameras(directions, radius=radius, size=size, orthographic=orthographic)
