"""Depth of rays against captured depth pictures."""

from collections.abc import Sequence
from typing import final

import torch
from torch import Tensor

from charnerf.losses.base import AbstractTerm, Needs
from charnerf.losses.terms import absolute_depth_error
from charnerf.types import FieldOutput, RenderOutput, TrainBatch


@final
class Depth(AbstractTerm):
    """Absolute error of the depth of rays that meet the surface, by their opacity.

    Args:
        weight: Of the term.

    Source: paper, Table II, the row with depth.
    """

    def __init__(self, *, weight: float) -> None:
        self.weights = {"depth": weight}
        self.needs = Needs(depth=True)

    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> None:
        """None: it looks at rays."""

    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """The error, m."""
        if batch.depth is None:
            return {}
        return {"depth": absolute_depth_error(rays.depth, batch.depth, rays.opacity)}
