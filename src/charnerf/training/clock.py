"""Training time, evaluation excluded, and the share of the budget that is used up; survives a resume.

Time is read after each step, by the first of a training's processes: all of them decide by the same seconds.
"""

import time
from typing import Any, final

import lightning as L

from charnerf.data.sampler import RunPosition
from charnerf.schedule import progress_of_run


@final
class RunClock(L.Callback):
    """Counts steps and training seconds, and stops the run when its budget is used up.

    Args:
        steps: Budget of steps, None for no bound.
        seconds: Budget of training seconds, None for no bound.
    """

    def __init__(self, *, steps: int | None, seconds: float | None) -> None:
        self.budget_steps = steps
        self.budget_seconds = seconds
        self.steps = 0
        self.seconds = 0.0  # of training, until the end of the last step
        self._running_since: float | None = None

    def position(self, step: int | None = None) -> RunPosition:
        """Where the run stands, or, as far as steps tell, will stand once `step` of them are done."""
        step = self.steps if step is None else step
        progress = progress_of_run(
            step=step,
            seconds=self.seconds,
            budget_steps=self.budget_steps,
            budget_seconds=self.budget_seconds,
        )
        return RunPosition(step=step, seconds=self.seconds, progress=progress)

    def pause(self) -> None:
        """Stop counting (evaluation, checkpoints)."""
        self._running_since = None

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """A run that goes on from its own end has nothing to do: without batches no batch would stop it."""
        if self.position().progress >= 1.0:
            trainer.should_stop = True

    def on_train_epoch_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Go on counting."""
        self._go_on()

    def on_train_batch_start(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Go on counting where no epoch starts: after a resume in the middle of one."""
        self._go_on()

    def on_train_batch_end(self, trainer: L.Trainer, pl_module: L.LightningModule, *_: Any) -> None:
        """Count the step; stop at the end of the budget."""
        assert self._running_since is not None
        now = time.perf_counter()
        self.seconds = trainer.strategy.broadcast(self.seconds + now - self._running_since)
        self._running_since = now
        self.steps += 1
        if self.position().progress >= 1.0:
            trainer.should_stop = True

    def on_validation_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Validation is not training time."""
        self.pause()

    def on_train_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Nor is what happens between epochs."""
        self.pause()

    def _go_on(self) -> None:
        if self._running_since is None:
            self._running_since = time.perf_counter()

    def state_dict(self) -> dict[str, Any]:
        """What a resumed run goes on from."""
        return {"steps": self.steps, "seconds": self.seconds}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from a checkpoint."""
        self.steps = int(state_dict["steps"])
        self.seconds = float(state_dict["seconds"])
        self._running_since = None
