"""The library's two objects: a loaded `Model`, and a `Hero`, one character encoded from its drawings."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import torch

from charnerf.models.charnerf import CharNeRF, EncodedViews
from charnerf.types import Scene, SourceViews
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
    """

    network: CharNeRF
    renderer: AbstractRenderer
    config: Any
    source: Path

    @property
    def image_size(self) -> int:
        """Side of the drawings that the encoder was trained on, pixels."""
        return int(self.config.scale.image_size)

    def encode_views(self, views: SourceViews) -> "Hero":
        """Encode source views of one character, B = 1, that have their cameras already."""
        with torch.no_grad():
            encoded = self.network.encode(views)
            scene = self.network.scene(encoded, 0)
        return Hero(scene=scene, views=views, encoded=encoded, renderer=self.renderer)


@final
@dataclass(frozen=True)
class Hero:
    """One character, encoded once; looked at and meshed as often as wanted.

    Attributes:
        scene: Its field.
        views: The drawings as source views, B = 1.
        encoded: What the encoder made of them.
        renderer: How it is rendered.
    """

    scene: Scene
    views: SourceViews
    encoded: EncodedViews
    renderer: AbstractRenderer
