"""Runs of a few steps: composed and assembled as `run_training` does it, without what follows training."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import lightning as L
import torch
from omegaconf import DictConfig

from charnerf.config.composition import compose_config
from charnerf.data.datamodule import MixedDataModule
from charnerf.inference.build import build_model, build_renderer
from charnerf.training.board import Board
from charnerf.training.clock import RunClock
from charnerf.training.data import build_data
from charnerf.training.identity import settings_of
from charnerf.training.module import TrainingModule
from charnerf.training.run import build_losses, build_module
from charnerf.training.trainer import build_trainer


def smoke_config(root: Path, *overrides: str) -> DictConfig:
    """The smallest run on a data set, on the CPU."""
    return compose_config(
        ["scale=smoke", "trainer=cpu", "data=folder", f"data.root={root}", "validation.views=1", *overrides]
    )


class Recorder(L.Callback):
    """Keeps what each step lost and was made of; stops a run as a power cut would."""

    def __init__(self, *, cut_at: int | None = None) -> None:
        self.cut_at = cut_at
        self.losses: list[float] = []
        self.batches: list[tuple[int, int, int, int]] = []

    def on_train_batch_start(self, trainer: Any, pl_module: Any, batch: Any, batch_idx: int) -> None:
        if batch.step == self.cut_at:
            raise ConnectionAbortedError("power cut")

    def on_train_batch_end(
        self, trainer: Any, pl_module: Any, outputs: Any, batch: Any, batch_idx: int
    ) -> None:
        self.losses.append(float(outputs["loss"]))
        points = 0 if batch.surface is None else batch.surface.points[..., 0].numel()
        self.batches.append((batch.step, batch.phase, batch.alpha.numel(), points))


@dataclass
class SmallRun:
    """A run put together."""

    module: TrainingModule
    data: MixedDataModule
    trainer: L.Trainer
    clock: RunClock
    board: Board
    recorder: Recorder = field(default_factory=Recorder)

    def fit(self, checkpoint: Path | None = None) -> "SmallRun":
        """Train."""
        self.trainer.fit(
            self.module, datamodule=self.data, ckpt_path=checkpoint, weights_only=checkpoint is not None
        )
        return self


def assemble(cfg: DictConfig, folder: Path, *, cut_at: int | None = None) -> SmallRun:
    """Everything that `run_training` builds before it trains."""
    L.seed_everything(cfg.seed, verbose=False)
    folder.mkdir(parents=True, exist_ok=True)
    model = build_model(cfg)
    clock = RunClock(steps=cfg.budget.steps, seconds=cfg.budget.seconds)
    losses, needs = build_losses(cfg)
    module = build_module(cfg, model, build_renderer(cfg), losses, clock)
    data = build_data(cfg, Path(cfg.data.root), model, clock, needs)
    board = Board(folder=folder / "tensorboard", clock=clock, settings=settings_of(cfg))
    trainer = build_trainer(cfg, folder, clock, losses.names, board)
    recorder = Recorder(cut_at=cut_at)
    trainer.callbacks.insert(1, recorder)  # type: ignore[attr-defined]
    return SmallRun(module, data, trainer, clock, board, recorder)


def weights(module: torch.nn.Module) -> torch.Tensor:
    """All parameters in one vector."""
    return torch.cat([parameter.detach().reshape(-1) for parameter in module.parameters()])
