"""Changes of a training batch, one after the other."""

from collections.abc import Sequence
from typing import final

import torch

from charnerf.data.augmentation.base import AbstractAugmentation
from charnerf.types import TrainBatch


@final
class AugmentationSequence:
    """Changes a training batch at random, one change after the other.

    The numbers that all of them decide by are drawn first, in the order of the sequence: what one change draws besides
    does not move the decisions of the next.

    Args:
        changes: In order; none leaves batches as they are.
    """

    def __init__(self, changes: Sequence[AbstractAugmentation]) -> None:
        self.changes = tuple(changes)

    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch changed at random."""
        counts = [change.num_draws for change in self.changes]
        draws = torch.rand(sum(counts), generator=generator).split(counts)
        for change, own in zip(self.changes, draws, strict=True):
            batch = change(batch, own, generator)
        return batch
