"""Colours of rays against the pictures'."""

from collections.abc import Sequence
from typing import final

import torch
from torch import Tensor

from charnerf.losses.base import AbstractTerm, Needs
from charnerf.losses.terms import squared_color_error
from charnerf.types import FieldOutput, RenderOutput, TrainBatch


@final
class Reconstruction(AbstractTerm):
    """Squared error of the colours of rays.

    Args:
        weight: Of the term.

    Source: paper, Final Loss function (weight 1.0).
    """

    def __init__(self, *, weight: float) -> None:
        self.weights = {"reconstruction": weight}
        self.needs = Needs()

    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> None:
        """None: it looks at rays."""

    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """The error."""
        return {"reconstruction": squared_color_error(rays.rgb, batch.rgb)}
