"""Characters in other colours."""

from dataclasses import replace
from typing import final

import torch
from torch import Tensor

from charnerf.data.augmentation.base import AbstractAugmentation
from charnerf.types import TrainBatch


@final
class Recolor(AbstractAugmentation):
    """Colour channels in another order.

    Args:
        share: Of the characters, in [0, 1].
    """

    num_draws = 1

    def __init__(self, *, share: float) -> None:
        self.share = share

    def __call__(self, batch: TrainBatch, draws: Tensor, generator: torch.Generator) -> TrainBatch:
        """Return the batch in a random order of its channels, or as it is."""
        return recolor(batch, torch.randperm(3, generator=generator)) if draws[0] < self.share else batch


def recolor(batch: TrainBatch, order: Tensor) -> TrainBatch:
    """Permute the colour channels of drawings and targets alike."""
    images = torch.cat((batch.views.images[:, :, order], batch.views.images[:, :, 3:]), dim=2)
    surface = batch.surface
    return replace(
        batch,
        views=replace(batch.views, images=images),
        rgb=batch.rgb[..., order],
        surface=None if surface is None else replace(surface, rgb=surface.rgb[..., order]),
    )
