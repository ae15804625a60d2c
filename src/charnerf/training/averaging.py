"""Averaged weights: what is validated, saved and shipped is a moving average of what is trained."""

from typing import final

import lightning as L
from lightning.pytorch.callbacks import WeightAveraging
from torch import Tensor
from torch.optim.swa_utils import get_ema_multi_avg_fn


@final
class WeightAverage(WeightAveraging):
    """Keeps an exponential moving average of the weights beside those that the optimizer moves.

    After n updates the average moves by 1 - min(decay, (1 + n) / (10 + n)) of the way: early weights are
    forgotten fast. While validation runs and after the end the network holds the average, and a checkpoint's
    `state_dict` is the average, so that everything that loads a checkpoint gets it; a resumed run finds the
    trained weights beside it. A run that goes on from a checkpoint without an average begins one.

    Args:
        decay: In [0, 1); 0 is no averaging, 0.999 averages over about a thousand steps.

    Source: warm-up of the decay as in TensorFlow's `ExponentialMovingAverage(num_updates=...)`.
    """

    def __init__(self, *, decay: float) -> None:
        def move(averages: list[Tensor], weights: list[Tensor], count: Tensor) -> None:
            updates = int(count) - 1
            get_ema_multi_avg_fn(min(decay, (1 + updates) / (10 + updates)))(averages, weights, count)

        super().__init__(use_buffers=False, multi_avg_fn=move)

    def setup(self, trainer: L.Trainer, pl_module: L.LightningModule, stage: str) -> None:
        """Begin with the weights as they are: torch's average would begin with those after the first step."""
        super().setup(trainer, pl_module, stage)
        if self._average_model is not None:
            self._average_model.update_parameters(pl_module)
