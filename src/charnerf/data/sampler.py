"""Which batch comes next: the sampler asks the schedule for counts, in the main process, so that they are exact and resumable."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, final

import numpy as np
from torch.utils.data import Sampler

from charnerf.schedule import PhaseSchedule


@dataclass(frozen=True)
class RunPosition:
    """Where a run stands: steps done, training seconds, share of the budget used up."""

    step: int
    seconds: float
    progress: float


class Position(Protocol):
    """Something that knows where the run stands."""

    def __call__(self, step: int | None = None) -> RunPosition:
        """Return the position now, or as it is at this moment of time once `step` steps are done."""
        ...


@dataclass(frozen=True)
class BatchRequest:
    """What a batch shall hold.

    Attributes:
        step: Index of the batch in the run; seeds everything random in it.
        rays: Rays a process, of all its characters together.
        surface_points: Surface points a process, of all its characters together.
        square: Side of the square of neighbouring rays that each character has besides, pixels; 0 for none.
        phase: Index of the phase.
        loss_weights: Loss weights that the phase overrides.
    """

    step: int
    rays: int
    surface_points: int
    square: int
    phase: int
    loss_weights: Mapping[str, float]


@dataclass(frozen=True)
class Share:
    """Which part of every step's batch one of the processes of a training makes; alone it makes all of it.

    Attributes:
        process: Its number, from 0.
        processes: How many there are.
    """

    process: int = 0
    processes: int = 1


def step_seed(seed: int, *place: int) -> int:
    """Seed of what is random at a place in a run, hashed to 32 bits: torch's CPU generator drops all bits above.

    Args:
        seed: Of the run.
        place: The step; of what is random about one character also its place in the step's batch, and which of its streams.
    """
    return int(np.random.SeedSequence(seed, spawn_key=place).generate_state(1)[0])


@final
class PhaseSampler(Sampler[BatchRequest]):
    """Requests until the next mark of progress or the end of the budget; an epoch is a stretch between two validations.

    Args:
        schedule: The phases.
        position: Where the run stands, asked before each batch.
        num_marks: Stretches that a run is divided into.
    """

    def __init__(self, *, schedule: PhaseSchedule, position: Position, num_marks: int) -> None:
        self.schedule = schedule
        self.position = position
        self.num_marks = num_marks

    def __iter__(self) -> Iterator[BatchRequest]:
        """Yield requests of one epoch; they are counted here, since the trainer asks for them ahead of its steps."""
        now = self.position()
        stretch = self._stretch(now)
        while now.progress < 1.0 and self._stretch(now) <= stretch:
            index = self.schedule.index_at(step=now.step, seconds=now.seconds, progress=now.progress)
            phase = self.schedule.phases[index]
            yield BatchRequest(
                step=now.step,
                rays=phase.rays,
                surface_points=phase.surface_points,
                square=phase.square,
                phase=index,
                loss_weights=phase.loss_weights,
            )
            now = self.position(now.step + 1)

    def _stretch(self, now: RunPosition) -> int:
        return int(now.progress * self.num_marks)
