"""Averaged weights: what is validated, saved and shipped is a moving average of what is trained."""

from typing import Any, final

import lightning as L
import torch
from torch import Tensor

from charnerf.training.module import TrainingModule

PREFIX = "model."  # of the network's names in a checkpoint
TRAINED = "trained_weights"  # key of a checkpoint: what the optimiser goes on with


@final
class WeightAverage(L.Callback):
    """Keeps an exponential moving average of the weights beside those that the optimiser moves.

    After n updates the average moves by 1 - min(decay, (1 + n) / (10 + n)) of the way: early weights are
    forgotten fast. While validation runs and after the end the network holds the average, and a checkpoint's
    `state_dict` is the average, so that everything that loads a checkpoint gets it; a resumed run finds the
    trained weights beside it. A run that goes on from a checkpoint without an average begins one.

    Args:
        decay: In [0, 1); 0 is no averaging, 0.999 averages over about a thousand steps.

    Source: warm-up of the decay as in TensorFlow's `ExponentialMovingAverage(num_updates=...)`.
    """

    def __init__(self, *, decay: float) -> None:
        self.decay = decay
        self.updates = 0
        self.shown = False  # whether the network holds the average and `others` the trained weights
        self.others: dict[str, Tensor] = {}

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Begin with the weights as they are, or bring the resumed average to where they are."""
        weights = _weights(pl_module)
        found = self.others or weights
        self.others = {name: found[name].detach().to(weights[name].device, copy=True) for name in weights}

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Move the average towards the weights after the step."""
        decay = min(self.decay, (1 + self.updates) / (10 + self.updates))
        self.updates += 1
        with torch.no_grad():
            for name, weight in _weights(pl_module).items():
                self.others[name].lerp_(weight, 1.0 - decay)

    def on_validation_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Validate the average."""
        if self.others:
            self._exchange(pl_module)

    def on_validation_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Go on with the trained weights."""
        if self.others:
            self._exchange(pl_module)

    def on_train_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Leave the average in the network."""
        self._exchange(pl_module)

    def state_dict(self) -> dict[str, Any]:
        """What a resumed run goes on from, beside the weights."""
        return {"updates": self.updates}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from a checkpoint."""
        self.updates = int(state_dict["updates"])

    def on_save_checkpoint(
        self, trainer: L.Trainer, pl_module: L.LightningModule, checkpoint: dict[str, Any]
    ) -> None:
        """The average becomes the checkpoint's weights, the trained weights lie beside it."""
        held = {name: weight.detach() for name, weight in _weights(pl_module).items()}
        average, trained = (held, self.others) if self.shown else (self.others, held)
        checkpoint["state_dict"] |= {PREFIX + name: value for name, value in average.items()}
        checkpoint[TRAINED] = trained

    def on_load_checkpoint(
        self, trainer: L.Trainer, pl_module: L.LightningModule, checkpoint: dict[str, Any]
    ) -> None:
        """Take both apart again; Lightning has put the average into the network by now."""
        trained = checkpoint.get(TRAINED)
        if trained is None:
            return
        weights = _weights(pl_module)
        self.others = {name: checkpoint["state_dict"][PREFIX + name].clone() for name in weights}
        with torch.no_grad():
            for name, weight in weights.items():
                weight.copy_(trained[name])

    def _exchange(self, pl_module: L.LightningModule) -> None:
        with torch.no_grad():
            for name, weight in _weights(pl_module).items():
                held = weight.clone()
                weight.copy_(self.others[name])
                self.others[name] = held
        self.shown = not self.shown


def _weights(pl_module: L.LightningModule) -> dict[str, Tensor]:
    assert isinstance(pl_module, TrainingModule)
    return dict(pl_module.model.named_parameters())
