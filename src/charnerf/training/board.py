"""What TensorBoard shows of a run, laid out; docs/watching.md lists the tags."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, final

import lightning as L
import numpy as np
import torch
from tensorboard.compat.proto.summary_pb2 import Summary
from torch.utils.tensorboard import SummaryWriter
from torch.utils.tensorboard.summary import hparams
from trimesh import Trimesh

from charnerf.evaluation.timing import resident_mib
from charnerf.meshing.extract import vertex_colors
from charnerf.models.combinators.base import AbstractWeighing
from charnerf.training.clock import RunClock
from charnerf.training.events import forget
from charnerf.training.identity import Setting
from charnerf.training.module import MEASURES, TrainingModule

EVERY = 20  # steps between two points of a line
SECONDS = 10  # until what was written is on disk, for those who watch
BY_TIME, FINAL, MESH = (
    "by_milliseconds",
    "Final",
    "mesh",
)  # the hyper-parameter table shows the first five tags: capitals sort first
FINAL_SECONDS = ("render_per_frame", "train")
UPRIGHT = np.array(
    ((1, 0, 0), (0, 0, 1), (0, -1, 0))
)  # rows: TensorBoard's x, y (up), z (towards the reader) of the world's axes


@final
class Board(L.Callback):
    """Writes scalars, settings and the layout; the first process alone. Others that show something write through `writer`.

    Steps are steps done. Lines below `by_milliseconds` have training milliseconds in place of steps, a line a phase, so that
    TensorBoard draws error against seconds.

    Args:
        folder: Of the event files.
        clock: Of the run.
        settings: Of the run, by their full keys.
    """

    def __init__(self, *, folder: Path, clock: RunClock, settings: Mapping[str, Setting]) -> None:
        self.folder = folder
        self.clock = clock
        self.settings = settings
        self._writer: SummaryWriter | None = None
        self._rays, self._since = 0.0, 0.0  # rays since a training second

    @property
    def writer(self) -> SummaryWriter:
        """TensorBoard's, opened with the first thing that is written."""
        if self._writer is None:
            self._writer = SummaryWriter(str(self.folder), flush_secs=SECONDS)
        return self._writer

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Forget what a run did after the checkpoint from which it goes on; write settings and layout."""
        assert isinstance(pl_module, TrainingModule)
        self._rays, self._since = 0.0, self.clock.seconds
        if not trainer.is_global_zero:
            return
        forget(self.folder, self._is_of_the_past)
        size = sum(parameter.numel() for parameter in pl_module.model.parameters())
        _, begun, _ = hparams({**readable(self.settings), "num_parameters": size}, {})
        self._add_summary(begun)
        self.writer.add_custom_scalars(layout(pl_module))

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Write a point of every line now and then, and before each validation."""
        assert isinstance(pl_module, TrainingModule)
        self._rays += float(pl_module.logged["train/rays"])
        is_due = self.clock.steps % EVERY == 0 or trainer.fit_loop.epoch_loop.batch_progress.is_last_batch
        if not trainer.is_global_zero or not is_due:
            return
        for tag, value in pl_module.logged.items():
            self._add(tag, float(value))
        for kind, share in pl_module.left_out.shares().items():
            self._add(f"train/left_out/{kind}", share)
        spent = self.clock.seconds - self._since
        self._add("train/rays_per_second", self._rays / spent if spent > 0.0 else None)
        self._add("train/memory_mib", _memory_mib(trainer.strategy.root_device))
        self._rays, self._since = 0.0, self.clock.seconds

    def on_validation_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Write what was measured, by steps and by training time."""
        assert isinstance(pl_module, TrainingModule)
        if trainer.sanity_checking or not trainer.is_global_zero:
            return
        phase = int(pl_module.logged.get("train/phase", 0))
        for tag in MEASURES:
            if tag in trainer.callback_metrics:
                value = float(trainer.callback_metrics[tag])
                self._add(tag, value)
                name = f"{BY_TIME}/{tag.removeprefix('val/')}/phase_{phase}"
                self.writer.add_scalar(name, value, self._milliseconds)

    def on_save_checkpoint(
        self, trainer: L.Trainer, pl_module: L.LightningModule, checkpoint: dict[str, Any]
    ) -> None:
        """Put on the disk what a run that goes on from there will not write again."""
        self._flush()

    def on_exception(
        self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException
    ) -> None:
        """Put on the disk what led there."""
        self._flush()

    def finish(self, metrics: Mapping[str, Any]) -> None:
        """Write the final error and seconds, which the hyper-parameter table shows."""
        figures = {tag.removeprefix("val/"): metrics[tag.removeprefix("val/")] for tag in MEASURES}
        figures |= {f"seconds_{stage}": metrics["seconds"].get(stage) for stage in FINAL_SECONDS}
        for name, value in figures.items():
            self._add(f"{FINAL}/{name}", value)
        _, _, ended = hparams({}, {})
        self._add_summary(ended)
        self.writer.close()

    def add_mesh(self, name: str, mesh: Trimesh) -> None:
        """Write a mesh with colors at its vertices; TensorBoard's y is up, its reader looks along -z at the front."""
        colors = vertex_colors(mesh)
        if colors is None:
            return
        self.writer.add_mesh(
            f"{MESH}/{name}",
            vertices=torch.from_numpy((np.asarray(mesh.vertices) @ UPRIGHT.T).astype(np.float32)[None]),
            colors=torch.from_numpy(colors[None, :, :3].copy()),
            faces=torch.from_numpy(np.asarray(mesh.faces, dtype=np.int64)[None]),
            global_step=self.clock.steps,
        )

    @property
    def _milliseconds(self) -> int:
        return round(1000.0 * self.clock.seconds)

    def _add(self, tag: str, value: float | None) -> None:
        """Write a point of a line; none where there is nothing of the kind."""
        if value is not None:
            self.writer.add_scalar(tag, value, self.clock.steps)

    def _add_summary(self, summary: Summary) -> None:
        assert self.writer.file_writer is not None
        self.writer.file_writer.add_summary(summary)

    def _flush(self) -> None:
        if self._writer is not None:
            self._writer.flush()

    def _is_of_the_past(self, tag: str, step: int) -> bool:
        """Whether an event tells of training before now; what is written once a start or after training is written again."""
        if tag.startswith(("_hparams_", "custom_scalars", f"{FINAL}/", f"{MESH}/")):
            return False
        done = self._milliseconds if tag.startswith(f"{BY_TIME}/") else self.clock.steps
        return 0 < step <= done


def readable(settings: Mapping[str, Setting]) -> dict[str, Setting]:
    """Settings as a table's columns: `combinator` is `Mean`, not `combinator._target_` the path of a class."""
    return {
        key.removesuffix("._target_"): str(value).rpartition(".")[2] if key.endswith("._target_") else value
        for key, value in settings.items()
    }


def layout(module: TrainingModule) -> dict[str, dict[str, list[Any]]]:
    """Charts of TensorBoard's page of custom scalars; tags are regular expressions. Attention only where H weighs views."""

    def lines(*tags: str) -> list[Any]:
        return ["Multiline", list(tags)]

    def by_time(name: str) -> list[Any]:
        return lines(rf"{BY_TIME}/{re.escape(name)}/phase_\d+$")

    charts = {
        "Error against training time (90k is 90 s; a line a phase)": {
            "foreground PSNR, dB": by_time("psnr_foreground"),
            "PSNR, dB": by_time("psnr"),
            "SSIM": by_time("ssim"),
        },
        "Loss": {
            "total": lines("train/loss/total$"),
            "terms": lines("train/loss/(?!total$).*"),
            "learning rate": lines("train/lr$"),
        },
        "Speed": {
            "rays a second": lines("train/rays_per_second$"),
            "shares left out": lines("train/left_out/.*"),
            "memory, MiB": lines("train/memory_mib$"),
        },
    }
    if isinstance(module.model.finest.combinator, AbstractWeighing):
        charts["Attention"] = {"share of each view": lines("attention/.*")}
    return charts


def _memory_mib(device: torch.device) -> float | None:
    """Most that was allocated on a GPU, what is resident elsewhere."""
    return torch.cuda.max_memory_allocated(device) / 2**20 if device.type == "cuda" else resident_mib()
