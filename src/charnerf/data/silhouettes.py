"""Points labelled inside or outside by the captured silhouettes: what the rays know of empty space, said directly."""

import torch
from torch import Tensor

from charnerf.data.store import OpenCharacter
from charnerf.geometry.cameras import project_into_all

CANDIDATES = 4  # points tried for each one asked for, so that both labels can be drawn evenly


def label_points(one: OpenCharacter, num_points: int, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Draw points in a character's hull and label them by all of its target pictures.

    A point that any picture shows as background is outside; one that every picture covers is inside (to the precision of that
    many silhouettes). Points on edges (partly covered somewhere) get no label and are passed over.

    Args:
        one: A character with a hull.
        num_points: Points to return, half of each label as far as the candidates allow.
        generator: Draws them.

    Returns:
        points (num_points, 3), m, and labels (num_points,), 1 inside, 0 outside.
    """
    assert one.hull is not None
    hull = one.hull[0]
    cells = hull.occupancy.reshape(-1).nonzero()[:, 0]
    side = hull.occupancy.shape[0]
    picked = cells[torch.randint(len(cells), (CANDIDATES * num_points,), generator=generator)]
    index = torch.stack((picked // (side * side), picked // side % side, picked % side), dim=-1)
    jitter = torch.rand(index.shape, generator=generator)
    points = hull.box_min + (index + jitter) * ((hull.box_max - hull.box_min) / side)
    lowest = _lowest_alpha(one, points)
    inside, outside = (lowest > 0.9).nonzero()[:, 0], (lowest < 0.1).nonzero()[:, 0]
    half = num_points // 2
    few = min(len(inside), len(outside), half)
    kept = torch.cat(
        (inside[: num_points - min(len(outside), half)], outside[: num_points - min(len(inside), half)])
    )
    if few == 0 and len(kept) == 0:
        kept = torch.arange(num_points)
        return points[kept], (lowest[kept] > 0.5).float()
    kept = kept.repeat(-(-num_points // len(kept)))[:num_points]
    return points[kept], (lowest[kept] > 0.5).float()


def _lowest_alpha(one: OpenCharacter, points: Tensor) -> Tensor:
    """The smallest alpha over all pictures at the projections of points (P, 3), (P,) in [0, 1]."""
    cameras = one.character.cameras
    num_images, height, width = one.images.shape[:3]
    pixels, _, in_front = project_into_all(cameras, points)
    x, y = pixels[..., 0].floor().long(), pixels[..., 1].floor().long()
    seen = in_front & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    flat = (torch.arange(num_images) * height + y.clamp(0, height - 1)) * width + x.clamp(0, width - 1)
    alpha = one.images.reshape(-1, 4)[:, 3][flat].float() / 255.0
    return torch.where(seen, alpha, 1.0).amin(-1)
