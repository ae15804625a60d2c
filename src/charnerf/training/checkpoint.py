"""Checkpoints of a run: `last.ckpt`, the one before it, `previous.ckpt`, and the best; which one a run goes on from."""

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, final

import lightning as L
import torch
from lightning.pytorch.callbacks import Checkpoint
from lightning.pytorch.plugins.io import CheckpointIO

from charnerf.errors import ConfigError, DataError
from charnerf.inference.checkpoint_file import read_checkpoint, write_checkpoint
from charnerf.interruption import Stopped, is_listening, listen, requested

log = logging.getLogger(__name__)
LAST, PREVIOUS, BROKEN = "last.ckpt", "previous.ckpt", "last.ckpt.broken"


@final
class CheckpointFiles(CheckpointIO):
    """Writes and reads checkpoints for Lightning: whole or not at all, with a checksum, the last two kept."""

    def save_checkpoint(
        self, checkpoint: dict[str, Any], path: Any, storage_options: Any | None = None
    ) -> None:
        """Write one; the last one before becomes the previous one."""
        file = Path(path)
        write_checkpoint(file, checkpoint, keep=file.with_name(PREVIOUS) if file.name == LAST else None)

    def load_checkpoint(
        self, path: Any, map_location: Any | None = None, weights_only: bool | None = None
    ) -> dict[str, Any]:
        """Read one, on the CPU."""
        return read_checkpoint(Path(path))

    def remove_checkpoint(self, path: Any) -> None:
        """Remove one."""
        Path(path).unlink(missing_ok=True)


@final
class LastCheckpoint(Checkpoint):
    """Writes the last checkpoint: at validations, between two that are far apart, and when a signal asks the run to end.

    At the last step before a validation it waits for that, so that a resumed run does not leave it out.

    Args:
        file: Where to.
        every: Seconds between two.
        on_saved: Called after each, such as to write what describes it.
    """

    def __init__(self, *, file: Path, every: float, on_saved: Callable[[], object]) -> None:
        self.file = file
        self.every = every
        self.on_saved = on_saved
        self._written = 0.0

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Begin to count; take the signals, of which Lightning has taken one for itself."""
        self._written = time.monotonic()
        if is_listening():
            listen()

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Write where one is due."""
        if trainer.fit_loop.epoch_loop.batch_progress.is_last_batch:
            return
        asked = self._asked(trainer)
        is_due = time.monotonic() - self._written >= self.every
        if asked or trainer.strategy.broadcast(is_due):
            self._save(trainer)
        if asked:
            self._stop(trainer, asked)

    def on_validation_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Write; end where that is asked for and the run is not over."""
        self._save(trainer)
        if not trainer.should_stop and (asked := self._asked(trainer)):
            self._stop(trainer, asked)

    def _asked(self, trainer: L.Trainer) -> int:
        """Number of the signal that came to this process or another one of the training; 0 before."""
        asked = torch.tensor(requested() or 0, device=trainer.strategy.root_device)
        return int(trainer.strategy.reduce(asked, reduce_op="max"))

    def _save(self, trainer: L.Trainer) -> None:
        trainer.save_checkpoint(self.file)
        self._written = time.monotonic()
        if trainer.is_global_zero:
            self.on_saved()

    def _stop(self, trainer: L.Trainer, signal: int) -> NoReturn:
        log.warning(
            "Stopped after step %d; the checkpoint is %s. The same command goes on, a single run's with hydra.run.dir=%s"
            " ckpt_path=last",
            trainer.global_step,
            self.file,
            self.file.parent.parent,
        )
        raise Stopped(signal)


def find_checkpoint(ckpt_path: str | None, folder: Path) -> Path | None:
    """The checkpoint that a run goes on from; it is whole.

    Args:
        ckpt_path: None, a file, or `last`: of this run folder.
        folder: The run folder.

    Returns:
        None where the run begins: nothing is asked for, or the run was ended before its first checkpoint, which is said.

    Raises:
        ConfigError: If there is no such file, or a new run is asked for in the folder of another.
        DataError: If it is broken, and there is none before it.
    """
    if ckpt_path is None:
        _refuse_used(folder)
        return None
    if ckpt_path == "last":
        return _last_of(folder)
    file = Path(ckpt_path)
    if not file.is_file():
        raise ConfigError(
            f"ckpt_path: found {ckpt_path!r}, which is no file; expected a .ckpt, `last` or null."
        )
    read_checkpoint(file)
    return file.resolve()


def has_checkpoint(folder: Path) -> bool:
    """Whether a run folder holds a checkpoint to go on from, perhaps a broken one."""
    return any((folder / "checkpoints" / name).is_file() for name in (LAST, PREVIOUS))


def _refuse_used(folder: Path) -> None:
    used = [name for name in (f"checkpoints/{LAST}", f"checkpoints/{PREVIOUS}", "weights.safetensors")]
    there = next((name for name in used if (folder / name).is_file()), None)
    if there is not None:
        raise ConfigError(
            f"hydra.run.dir: {folder} holds a run already ({there}), expected a new folder; go on with it by ckpt_path=last, or"
            " name another folder."
        )


def _last_of(folder: Path) -> Path | None:
    """The last whole checkpoint of a run folder; a broken one is put aside, so that it takes no other's place."""
    last, previous = (folder / "checkpoints" / name for name in (LAST, PREVIOUS))
    if not has_checkpoint(folder):
        log.warning(
            "ckpt_path=last: %s holds no checkpoint, so the run begins.%s", folder, _neighbour(folder)
        )
        return None
    problem = f"{last}: does not exist."
    if last.is_file():
        try:
            read_checkpoint(last)
            return last
        except DataError as error:
            problem = str(error)
    if not previous.is_file():
        raise DataError(f"{problem} There is none before it; remove it, and the run begins again.")
    try:
        read_checkpoint(previous)
    except DataError as error:
        raise DataError(f"{problem} {error} Remove both, and the run begins again.") from error
    if last.is_file():
        last.replace(last.with_name(BROKEN))
        problem += f" It is {BROKEN} now."
    log.warning("%s Goes on from the one before, %s.", problem, previous)
    return previous


def _neighbour(folder: Path) -> str:
    """What to type to go on with the newest run beside a folder, if there is one."""
    others = [run for run in folder.parent.glob("*") if run != folder and has_checkpoint(run)]
    if not others:
        return ""
    newest = max(others, key=lambda run: (run / "checkpoints").stat().st_mtime)
    return f" To go on with the newest run beside it, name it: hydra.run.dir={newest}"
