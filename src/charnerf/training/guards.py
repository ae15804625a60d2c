"""What stops or warns a training that went wrong."""

import logging
import math
from pathlib import Path
from typing import Any, final

import lightning as L
import torch

from charnerf.errors import NumericalError
from charnerf.files import write_aside
from charnerf.training.module import TrainingModule
from charnerf.types import TrainBatch

log = logging.getLogger(__name__)

COLLAPSED_OPACITY = 0.02
PATIENCE = 200  # steps


@final
class FiniteGuard(L.Callback):
    """Stops at the first loss that is not finite and saves the batch beside the run.

    Args:
        folder: Where the batch is written.
    """

    def __init__(self, *, folder: Path) -> None:
        self.folder = folder

    def on_train_batch_end(
        self,
        trainer: L.Trainer,
        pl_module: L.LightningModule,
        outputs: Any,
        batch: TrainBatch,
        batch_idx: int,
    ) -> None:
        """Look at the loss of the step just done."""
        assert isinstance(pl_module, TrainingModule)
        loss = float(pl_module.logged["train/loss/total"])  # of all processes, so that all end
        if math.isfinite(loss):
            return
        part = f"_{trainer.global_rank}" if trainer.world_size > 1 else ""
        path = self.folder / f"nonfinite_batch_{batch.step:07d}{part}.pt"
        content = {"step": batch.step, "names": batch.names, "rgb": batch.rgb, "alpha": batch.alpha}
        with write_aside(path) as aside:
            torch.save(content, aside)
        raise NumericalError(
            f"train/loss/total at step {batch.step}: found {loss}, expected a finite number. The batch (characters "
            f"{', '.join(batch.names)}) is in {path}; lower optimizer.lr, or resume from checkpoints/last.ckpt."
        )


@final
class WhiteAlarm(L.Callback):
    """Warns once when the field has become empty where the character is: training has collapsed to white."""

    def __init__(self) -> None:
        self.empty_steps = 0

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Count steps without any opacity on the character."""
        assert isinstance(pl_module, TrainingModule)
        opacity = float(pl_module.logged["train/opacity_foreground"])
        if math.isnan(opacity):
            return
        self.empty_steps = self.empty_steps + 1 if opacity < COLLAPSED_OPACITY else 0
        if self.empty_steps == PATIENCE:
            log.warning(
                "Training collapsed to white: the mean opacity on the character has been below %.2f for %d steps. Raise "
                "batches.foreground_share, lower optimizer.lr, or use a softplus density.",
                COLLAPSED_OPACITY,
                PATIENCE,
            )
