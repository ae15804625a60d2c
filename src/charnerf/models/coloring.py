"""Colours of places by drawings and by what a head says of their shares: of one character, without any network."""

from dataclasses import dataclass, replace
from typing import final

from torch import Tensor

from charnerf.geometry.cameras import project_into_all
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
        """Colours (P, ..., 3) of points (P, 3) of appearances (P, ..., C): the drawings are read once a point."""
        pixels, _, _ = project_into_all(self.cameras, points)
        uv = pixels / pixels.new_tensor((self.cameras.width, self.cameras.height))
        drawn, flat = self.pictures.read(uv), appearance.reshape(-1, appearance.shape[-1])
        rgb = self.head.rgb_of(flat, drawn.repeat_interleave(len(flat) // max(1, len(drawn)), dim=0))
        return rgb.view(*appearance.shape[:-1], 3)

    def at_width(self, width: int) -> "DrawnColoring":
        """By the detailed drawings, so many pixels wide; by the encoded ones where those are as wide."""
        if self.detailed is None or width <= self.cameras.width:
            return replace(self, pictures=self.encoded)
        return replace(self, pictures=Pictures.of(self.detailed, width))
