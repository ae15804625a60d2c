"""Opacity of rays against the pictures' alpha."""

from collections.abc import Sequence
from typing import final

import torch
from torch import Tensor

from charnerf.losses.base import AbstractTerm, Needs
from charnerf.losses.terms import squared_opacity_error
from charnerf.types import FieldOutput, RenderOutput, TrainBatch


@final
class Opacity(AbstractTerm):
    """Squared error of the opacity of rays (beyond the paper).

    Args:
        weight: Of the term.
    """

    def __init__(self, *, weight: float) -> None:
        self.weights = {"opacity": weight}
        self.needs = Needs()

    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> None:
        """None: it looks at rays."""

    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """The error."""
        return {"opacity": squared_opacity_error(rays.opacity, batch.alpha)}
