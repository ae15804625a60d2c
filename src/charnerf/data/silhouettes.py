"""Points labelled inside or outside by the captured silhouettes: what the rays know of empty space, said directly."""

from typing import final

import torch
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.data.space import AbstractSpace, hull_points
from charnerf.geometry.cameras import project_into_all
from charnerf.types import Hull, SpacePoints

CANDIDATES = 4  # points tried for each one asked for, so that both labels can be drawn evenly


@final
class SilhouetteSpace(AbstractSpace):
    """Points in a character's hull labelled by all of its target pictures.

    A point that any picture shows as background is outside; one that every picture covers is inside (to the precision of that
    many silhouettes). Points on edges (partly covered somewhere) get no label and are passed over. Half of each label are drawn,
    as far as the candidates allow.

    Args:
        character: The files.
        images: Of its targets, uint8 (N, H, W, 4).
        hull: Of its drawings, B = 1.
    """

    def __init__(self, character: Character, images: Tensor, hull: Hull) -> None:
        self.hull = hull
        self.cameras = character.cameras
        self.images = images

    @property
    def size_bytes(self) -> int:
        """Nothing beside pictures and hull."""
        return 0

    def sample(self, num_points: int, generator: torch.Generator) -> SpacePoints:
        """Draw points; see `AbstractPoints.sample`."""
        points = hull_points(self.hull, CANDIDATES * num_points, generator)
        lowest = self._lowest_alpha(points)
        inside, outside = (lowest > 0.9).nonzero()[:, 0], (lowest < 0.1).nonzero()[:, 0]
        half = num_points // 2
        kept = torch.cat(
            (inside[: num_points - min(len(outside), half)], outside[: num_points - min(len(inside), half)])
        )
        if len(kept) == 0:
            kept = torch.arange(num_points)
        kept = kept.repeat(-(-num_points // len(kept)))[:num_points]
        return SpacePoints(points[kept][None], (lowest[kept] > 0.5).float()[None])

    def _lowest_alpha(self, points: Tensor) -> Tensor:
        """The smallest alpha over all pictures at the projections of points (P, 3), (P,) in [0, 1]."""
        num_images, height, width = self.images.shape[:3]
        pixels, _, in_front = project_into_all(self.cameras, points)
        x, y = pixels[..., 0].floor().long(), pixels[..., 1].floor().long()
        seen = in_front & (x >= 0) & (x < width) & (y >= 0) & (y < height)
        flat = (torch.arange(num_images) * height + y.clamp(0, height - 1)) * width + x.clamp(0, width - 1)
        alpha = self.images.reshape(-1, 4)[:, 3][flat].float() / 255.0
        return torch.where(seen, alpha, 1.0).amin(-1)
