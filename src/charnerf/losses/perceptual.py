"""Squares of neighbouring rays against the pictures', by the features of a network that has seen many pictures."""

from collections.abc import Sequence
from typing import final

import torch
from torch import Tensor

from charnerf.losses.alex_lpips import AlexLpips
from charnerf.losses.base import AbstractTerm, Needs
from charnerf.types import FieldOutput, RenderOutput, TrainBatch


@final
class Perceptual(AbstractTerm):
    """LPIPS by AlexNet of each character's square of rays (beyond the paper).

    A squared error of colours asks for a blur where an edge may stand in one of two places; this asks for an edge.

    Args:
        weight: Of the term.

    Source: Zhang 2018 (The Unreasonable Effectiveness of Deep Features as a Perceptual Metric).
    """

    def __init__(self, *, weight: float) -> None:
        self.weights = {"perceptual": weight}
        self.needs = Needs()
        self._network: AlexLpips | None = None  # read where the term first weighs something

    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> None:
        """None: it looks at rays."""

    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """The mean distance."""
        if not batch.square:
            return {}
        if self._network is None:
            self._network = AlexLpips().to(rays.rgb.device).requires_grad_(False)
        pairs = zip(_pictures(rays.rgb, batch.square), _pictures(batch.rgb, batch.square), strict=True)
        return {
            "perceptual": torch.cat([self._network(shown[None], true[None]) for shown, true in pairs]).mean()
        }


def _pictures(rgb: Tensor, side: int) -> Tensor:
    """Pictures (B, 3, side, side) of the first rays (B, R, 3)."""
    return rgb[:, : side * side].reshape(len(rgb), side, side, 3).movedim(-1, 1)
