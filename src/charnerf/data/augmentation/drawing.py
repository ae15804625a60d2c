"""Source views as somebody would draw them."""

from dataclasses import replace
from typing import final

import torch
from torch import Tensor

from charnerf.data.augmentation.base import AbstractAugmentation
from charnerf.data.drawing_style import draw_pictures, random_style
from charnerf.types import TrainBatch


@final
class Drawing(AbstractAugmentation):
    """Source views as somebody would draw them, with the small contradictions of views drawn one by one.

    Rays and points stay as captured, and so does the hull: what the drawings get wrong is to be averaged out, not learned.

    Args:
        share: Of the characters, in [0, 1].
        wobble: Largest displacement by the unsteady hand, as a share of the picture's side.
        shift: Largest offset of a view against the others, as a share of the side.
        scale: Largest relative difference in size of a view.
    """

    num_draws = 0  # it decides by the generator

    def __init__(self, *, share: float, wobble: float, shift: float, scale: float) -> None:
        self.share = share
        self.mistakes = {"wobble": wobble, "shift": shift, "scale": scale}

    def __call__(self, batch: TrainBatch, draws: Tensor, generator: torch.Generator) -> TrainBatch:
        """Return the batch with the source views of some characters drawn."""
        drawn = [
            draw_pictures(views, random_style(generator, **self.mistakes), generator)
            if float(torch.rand((), generator=generator)) < self.share
            else views
            for views in batch.views.images
        ]
        return replace(batch, views=replace(batch.views, images=torch.stack(drawn)))
