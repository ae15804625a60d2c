"""`Model`: a trained model, ready to encode characters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, final

import torch

from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.turnaround import Picture, read_views
from charnerf.drawings.viewpoints import Viewpoint, turnaround, viewpoint
from charnerf.errors import DataError, ShapeError
from charnerf.inference.hero import Hero
from charnerf.models.charnerf import CharNeRF
from charnerf.types import SourceViews
from charnerf.volume.renderers.base import AbstractRenderer


@final
@dataclass(frozen=True)
class Model:
    """A trained model, ready to use.

    Attributes:
        network: The networks, in eval mode, without gradients.
        renderer: How its scenes are rendered.
        config: The model's part of the config that it was trained with (an OmegaConf section).
        source: The file that it came from.
        note: What that file says about itself, such as that it is for one character; None if nothing.
    """

    network: CharNeRF
    renderer: AbstractRenderer
    config: Any
    source: Path
    note: str | None = None

    @property
    def image_size(self) -> int:
        """Side of the drawings that the encoder was trained on, pixels."""
        return self.network.image_size

    @property
    def device(self) -> torch.device:
        """Where the networks are."""
        return self.network.box[0].device

    def to(self, device: torch.device | str) -> Model:
        """The model on another device; the networks move, they are not copied."""
        return replace(self, network=self.network.to(device))

    def encode(
        self,
        *,
        front: Picture | None = None,
        side: Picture | None = None,
        back: Picture | None = None,
        side_is: Literal["left", "right"] = "left",
        views: Mapping[str | float, Picture] | None = None,
    ) -> Hero:
        """Encode one character from two drawings or more.

        Args:
            front: Image file, or array (H, W, 3 or 4) of uint8 or of floats in [0, 1]; alpha or a plain
                background; any size.
            side: In profile.
            back: Seen from behind.
            side_is: Which side of the character the side drawing shows; left: the face looks to the picture's
                left.
            views: Further drawings, or all of them, by where they are seen from: a name such as "three-quarter-front", an
                azimuth in degrees such as 45, or azimuth and elevation such as "45,20". Where drawings disagree, the first
                rules: front, side, back, then these.

        Returns:
            The character; `hero.turnaround` says what was assumed about the drawings.

        Raises:
            DataError: If a drawing can not be used, two show one view or there are fewer than two.
        """
        drawings = {
            view: one
            for view, one in turnaround(front, side, back, side_is=side_is).items()
            if one is not None
        }
        for name, one in (views or {}).items():
            if viewpoint(name) in drawings:
                raise DataError(f"view {name}: found two drawings of it, expected one. Leave one out.")
            drawings[viewpoint(name)] = one
        return self.encode_drawings(drawings)

    def encode_drawings(
        self, drawings: Mapping[Viewpoint, Picture], options: ReadingOptions | None = None
    ) -> Hero:
        """Encode one character from drawings by where they are seen from; arguments as of `drawings.turnaround.read_views`."""
        read = read_views(drawings, size=self.image_size, options=options)
        hero = self.encode_views(read.views, detailed=read.detailed)
        return replace(hero, turnaround=read)

    def encode_views(self, views: SourceViews, *, detailed: SourceViews | None = None) -> Hero:
        """Encode source views of one character, B = 1, that have their cameras already.

        Args:
            views: Of any size: they are encoded as large as the encoder was trained on.
            detailed: The same views with more pixels, for the colours of large pictures; `views` themselves where those are
                wider than the encoder's.

        Raises:
            ShapeError: If there is not exactly one character.
        """
        if views.images.shape[0] != 1:
            raise ShapeError(
                f"views: found {views.images.shape[0]} characters, expected 1; encode them one by one."
            )
        given = views.to(self.device)
        views = self.network.fitted(given)
        if detailed is None and given.cameras.width > self.image_size:
            detailed = given
        elif detailed is not None:
            detailed = detailed.to(self.device)
        with torch.no_grad():
            scene = self.network.scene(self.network.encode(views, detailed=detailed), 0)
        return Hero(scene=scene, views=views, renderer=self.renderer, detailed=detailed)
