"""Colours of places by drawings and by what a head says of their shares: of one character, without any network."""

from dataclasses import dataclass, replace
from typing import final

from torch import Tensor

from charnerf.geometry.cameras import pixel_planes
from charnerf.models.heads.base import AbstractHead
from charnerf.models.view_maps import Pictures
from charnerf.scene import AbstractColoring
from charnerf.types import Cameras, MovableRecord


@final
@dataclass(frozen=True)
class DrawnColoring(AbstractColoring, MovableRecord):
    """Colours by a head's rule, of drawings read where points project.

    Attributes:
        head: Whose rule.
        cameras: Of the drawings, (V,).
        encoded: The drawings as they were encoded.
        detailed: The same on white with more pixels, (V, 3, H, W), or None.
        pictures: Those that are read.
    """

    head: type[AbstractHead]
    cameras: Cameras
    encoded: Pictures
    detailed: Tensor | None
    pictures: Pictures

    def rgb_of(self, points: Tensor, appearance: Tensor) -> Tensor:
        """Colours (3, ..., P) of points (P, 3) of appearances (C, ..., P): the drawings are read once a point."""
        size = points.new_tensor((self.cameras.width, self.cameras.height))
        drawn = self.pictures.read_planes(pixel_planes(self.cameras, points) / size[:, None])
        between = [1] * (appearance.ndim - 2)
        return self.head.rgb_planes(appearance, drawn.view(*drawn.shape[:2], *between, -1))

    def at_width(self, width: int) -> "DrawnColoring":
        """By the detailed drawings, so many pixels wide; by the encoded ones where those are as wide."""
        if self.detailed is None or width <= self.cameras.width:
            return replace(self, pictures=self.encoded)
        return replace(self, pictures=Pictures.of(self.detailed, width))
