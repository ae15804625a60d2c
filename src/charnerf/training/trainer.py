"""Lightning's trainer of a run, and the config as TensorBoard shows it."""

from collections.abc import Sequence
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import lightning as L
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.loggers import TensorBoardLogger
from omegaconf import DictConfig, OmegaConf
from torch.utils.tensorboard.summary import hparams

from charnerf.inference.build import build_part
from charnerf.models.charnerf import CharNeRF
from charnerf.training.averaging import WeightAverage
from charnerf.training.clock import RunClock
from charnerf.training.guards import FiniteGuard, WhiteAlarm
from charnerf.training.monitor import BudgetBar, CurveWriter, PictureLogger

CHECKPOINT_EVERY = timedelta(minutes=5)  # at least; validations write checkpoints too
HYPER_METRICS = ("val/psnr", "val/psnr_foreground", "val/ssim")  # columns beside the hyper-parameters


def build_trainer(
    cfg: DictConfig, folder: Path, clock: RunClock, values: Sequence[str], *more: L.Callback
) -> L.Trainer:
    """Lightning's trainer with our callbacks; the budget, not Lightning, bounds the run.

    Args:
        cfg: Of the run.
        folder: The run folder.
        clock: Of the run.
        values: Names of the loss's values.
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
        PictureLogger(),
        *_checkpoints(folder / "checkpoints"),
    ]
    return build_part(
        cfg.trainer,
        {
            "callbacks": callbacks,
            "logger": TensorBoardLogger(str(folder), name="", version="tensorboard", default_hp_metric=False),
            "max_epochs": -1,
            "num_sanity_val_steps": 0,
            "enable_progress_bar": False,
            "enable_model_summary": False,
            "use_distributed_sampler": False,
            "gradient_clip_val": cfg.optimization.gradient_clip,
            "log_every_n_steps": 20,
        },
    )


def _checkpoints(folder: Path) -> list[ModelCheckpoint]:
    """The best by validation, and the last, written at validations and between two that are far apart."""
    write = partial(ModelCheckpoint, dirpath=folder, enable_version_counter=False)
    return [
        write(filename="best", monitor="val/psnr_foreground", mode="max"),
        write(filename="last"),  # of its own: Lightning's `save_last` writes only where the best improved
        write(filename="last", train_time_interval=CHECKPOINT_EVERY),
    ]


def log_hyperparameters(trainer: L.Trainer, cfg: DictConfig, model: CharNeRF) -> None:
    """Write the config and the number of parameters to TensorBoard's events and to hparams.yaml."""
    assert isinstance(trainer.logger, TensorBoardLogger)
    size = sum(parameter.numel() for parameter in model.parameters())
    values = {**_flat(OmegaConf.to_container(cfg, resolve=True)), "num_parameters": size}
    trainer.logger.log_hyperparams(values)  # writes no event unless it is given a metric's value
    for summary in hparams(values, dict.fromkeys(HYPER_METRICS, 0.0)):
        trainer.logger.experiment.file_writer.add_summary(summary)


def _flat(node: Any, key: str = "") -> dict[str, bool | int | float | str]:
    """Values of nested sections by their full keys."""
    if not isinstance(node, dict | list):
        return {key: node if isinstance(node, bool | int | float | str) else str(node)}
    items = node.items() if isinstance(node, dict) else enumerate(node)
    flat: dict[str, bool | int | float | str] = {}
    for name, value in items:
        flat |= _flat(value, f"{key}.{name}" if key else str(name))
    return flat
