"""Lightning's trainer of a run."""

import os
from collections.abc import Sequence
from datetime import timedelta
from functools import partial
from pathlib import Path

import lightning as L
from lightning.pytorch.callbacks import Checkpoint, ModelCheckpoint
from lightning.pytorch.plugins.environments import (
    ClusterEnvironment,
    LightningEnvironment,
    SLURMEnvironment,
    TorchElasticEnvironment,
)
from omegaconf import DictConfig

from charnerf.inference.build import build_part
from charnerf.inference.weights import save_config
from charnerf.training.averaging import WeightAverage
from charnerf.training.board import Board
from charnerf.training.checkpoint import LAST, CheckpointFiles, LastCheckpoint
from charnerf.training.clock import RunClock
from charnerf.training.guards import FiniteGuard, WhiteAlarm
from charnerf.training.monitor import BudgetBar, CurveWriter
from charnerf.training.validation_pictures import ShareWriter, ValidationPictures

CHECKPOINT_EVERY = timedelta(minutes=5)  # at most; validations write checkpoints too


def build_trainer(
    cfg: DictConfig,
    folder: Path,
    clock: RunClock,
    values: Sequence[str],
    board: Board,
    *more: L.Callback,
) -> L.Trainer:
    """Lightning's trainer with our callbacks; the budget, not Lightning, bounds the run.

    Args:
        cfg: Of the run.
        folder: The run folder.
        clock: Of the run.
        values: Names of the loss's values.
        board: Writes what TensorBoard shows.
        more: Further callbacks.
    """
    averages = [] if cfg.averaging.decay is None else [WeightAverage(decay=cfg.averaging.decay)]
    callbacks = [
        clock,
        *more,
        *averages,  # before what reads the weights at validation
        BudgetBar(clock=clock),
        FiniteGuard(folder=folder),
        WhiteAlarm(),
        CurveWriter(path=folder / "curve.csv", clock=clock, values=values),
        ValidationPictures(board=board),
        ShareWriter(board=board),
        board,  # after what is shown, before checkpoints
        *_checkpoints(cfg, folder),
    ]
    return build_part(
        cfg.trainer,
        {
            "callbacks": callbacks,
            "plugins": [CheckpointFiles(), environment()],
            "logger": False,  # the board writes
            "max_epochs": -1,
            "num_sanity_val_steps": 0,
            "enable_progress_bar": False,
            "enable_model_summary": False,
            "use_distributed_sampler": False,
            "gradient_clip_val": cfg.optimization.gradient_clip,
        },
    )


def _checkpoints(cfg: DictConfig, folder: Path) -> list[Checkpoint]:
    """The best by validation, and the last ones; config.yaml is that of the last one."""
    best = ModelCheckpoint(
        dirpath=folder / "checkpoints",
        filename="best",
        monitor="val/psnr_foreground",
        mode="max",
        enable_version_counter=False,
    )
    last = LastCheckpoint(
        file=folder / "checkpoints" / LAST,
        every=CHECKPOINT_EVERY.total_seconds(),
        on_saved=partial(save_config, folder, cfg),
    )
    return [best, last]


def environment() -> ClusterEnvironment:
    """Who begins the processes of a training: srun where it has begun several, torchrun, or the command itself.

    Lightning's own answer to SLURM's signals, which writes other checkpoints, is left out: ours is that of every machine.
    """
    if SLURMEnvironment.detect() and os.environ["SLURM_NTASKS"] != "1":
        return SLURMEnvironment(auto_requeue=False)
    return TorchElasticEnvironment() if TorchElasticEnvironment.detect() else LightningEnvironment()
