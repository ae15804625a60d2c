"""The frame of foreign worlds: upright, on the floor, 2 m tall, as every character of ours stands."""

import torch
from torch import Tensor

from charnerf.geometry.cameras import direction_from_angles
from charnerf.geometry.carving import figure_box
from charnerf.geometry.similarity import Similarity
from charnerf.geometry.world import HEIGHT
from charnerf.types import Cameras


def standing(cameras: Cameras, alphas: Tensor) -> Similarity:
    """What brings a figure onto the floor, around the z axis and to 2 m, by the visual hull of its silhouettes.

    Args:
        cameras: (N,), in an upright world.
        alphas: (N, H, W), in [0, 1].

    Raises:
        DataError: If the silhouettes are empty or have no point in common.
    """
    low, high = figure_box(cameras, alphas)
    scale = HEIGHT / float(high[2] - low[2])
    middle = 0.5 * (low + high)
    floor = torch.stack((middle[0], middle[1], low[2]))
    return Similarity(torch.eye(3, dtype=torch.float64), scale, -scale * floor)


def azimuth_turn(direction: Tensor) -> Tensor:
    """Rotation (3, 3) about z that brings a camera in a direction (3,) from the figure to azimuth 0."""
    angle = torch.atan2(direction[0], -direction[1])
    cosine, sine, zero, one = (
        torch.cos(angle),
        torch.sin(angle),
        torch.zeros_like(angle),
        torch.ones_like(angle),
    )
    return torch.stack((cosine, sine, zero, -sine, cosine, zero, zero, zero, one)).reshape(3, 3)


def level_direction(azimuth_deg: float) -> Tensor:
    """Unit vector (3,), float64, towards a level camera at an azimuth."""
    angle = torch.tensor(azimuth_deg, dtype=torch.float64)
    return direction_from_angles(angle, torch.zeros_like(angle))
