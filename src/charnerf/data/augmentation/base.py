"""What every change of a training batch offers."""

from abc import ABC, abstractmethod

import torch
from torch import Tensor

from charnerf.types import TrainBatch


class AbstractAugmentation(ABC):
    """A random change of a training batch.

    Attributes:
        num_draws: Numbers that it decides by whether, and how far, it changes a batch.
    """

    num_draws: int

    @abstractmethod
    def __call__(self, batch: TrainBatch, draws: Tensor, generator: torch.Generator) -> TrainBatch:
        """Return the batch changed, or as it is.

        Args:
            batch: Of captured characters, or changed before.
            draws: (num_draws,) in [0, 1).
            generator: Of what else it draws.
        """
