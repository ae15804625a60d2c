"""What a run tells while it trains: a progress bar with the time left, and curve.csv."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, final

import lightning as L

from charnerf.files import write_text
from charnerf.progress import Progress
from charnerf.training.clock import RunClock
from charnerf.training.module import TrainingModule

CURVE_COLUMNS = (
    "step",
    "phase",
    "seconds",
    "rays",
    "val_psnr",
    "val_psnr_foreground",
    "val_ssim",
)  # then the losses


@final
class BudgetBar(L.Callback):
    """Progress over the whole budget, with the time left.

    Args:
        clock: Of the run.
    """

    def __init__(self, *, clock: RunClock) -> None:
        self.clock = clock
        self.progress: Progress | None = None
        self.begun = 0.0  # where a resumed run goes on

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Begin to show it."""
        if not trainer.is_global_zero:
            return
        in_seconds = self.clock.budget_seconds is not None
        total = float(self.clock.budget_seconds or self.clock.budget_steps or 1)
        self.begun = min(self._spent(), total)
        stages = {"training": total - self.begun}
        self.progress = Progress("training", stages, in_seconds=in_seconds, begun=self.begun / total)
        self.progress.__enter__()

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Go on."""
        if self.progress is None:
            return
        rest, note = self.progress.costs["training"], None
        if self.clock.steps % 10 == 0:
            assert isinstance(pl_module, TrainingModule)
            loss = pl_module.logged.get("train/loss/total")
            best = trainer.callback_metrics.get("val/psnr_foreground")
            note = f"step {self.clock.steps}, loss {'-' if loss is None else f'{float(loss):.4f}'}"
            note += "" if best is None else f", val {float(best):.2f} dB on the foreground"
        self.progress.update((self._spent() - self.begun) / rest if rest else 1.0, note)

    def teardown(self, trainer: L.Trainer, pl_module: L.LightningModule, stage: str) -> None:
        """Leave the terminal as it was, however training ended."""
        if self.progress is not None:
            self.progress.close()
            self.progress = None

    def _spent(self) -> float:
        """Of the budget, in its unit."""
        return float(self.clock.steps if self.clock.budget_seconds is None else self.clock.seconds)

    def on_exception(
        self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException
    ) -> None:
        """End its line, so that the message begins one."""
        self.teardown(trainer, pl_module, "fit")


@final
class CurveWriter(L.Callback):
    """Writes curve.csv: one row a validation, the whole file at once, so that it is never half-written.

    Args:
        path: The file.
        clock: Of the run.
        values: Names of the loss's values, a column each.
    """

    def __init__(self, *, path: Path, clock: RunClock, values: Sequence[str]) -> None:
        self.path = path
        self.clock = clock
        self.values = values
        self.rows: list[dict[str, float | int | str]] = []

    def on_validation_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Add a row."""
        if trainer.sanity_checking or trainer.global_rank != 0:
            return
        assert isinstance(pl_module, TrainingModule)
        measured = {
            name: value for name, value in trainer.callback_metrics.items() if name.startswith("val/")
        }
        metrics = {
            **measured,
            **pl_module.logged,
        }  # of the last step alone: the trainer's hold values that a phase has ended

        def read(name: str) -> float | str:
            return float(metrics[name]) if name in metrics else ""

        row: dict[str, float | int | str] = {
            "step": self.clock.steps,
            "seconds": round(self.clock.seconds, 3),
        }
        row |= {"phase": read("train/phase"), "rays": read("train/rays")}
        row |= {name: read(f"val/{name[4:]}") for name in ("val_psnr", "val_psnr_foreground", "val_ssim")}
        row |= {term: read(f"train/loss/{term}") for term in self.values}
        self.rows.append(row)
        text = io.StringIO()
        writer = csv.DictWriter(text, fieldnames=[*CURVE_COLUMNS, *self.values], lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.rows)
        write_text(self.path, text.getvalue())

    def state_dict(self) -> dict[str, Any]:
        """Rows so far, for a resumed run."""
        return {"rows": self.rows}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from a checkpoint."""
        self.rows = list(state_dict["rows"])
