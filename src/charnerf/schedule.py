"""How many rays and surface points a training step takes, and when that changes; pure arithmetic, no state.

A phase lasts until a share of the run, a number of steps or a number of training seconds. Steps are counted
from 0, so that `until: {steps: 100}` makes steps 0 to 99 and leaves step 100 to the next phase, also after a
resume.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import final

from charnerf.errors import ConfigError

UNITS = ("share", "steps", "seconds")


@final
@dataclass(frozen=True, kw_only=True)
class Phase:
    """A stretch of training with fixed counts.

    Attributes:
        rays: Rays a step and process, of all characters of its batch together.
        surface_points: Surface points a step and process, of all its characters together; 0 trains by rays alone.
        square: Side of a square of neighbouring rays that each character has besides, pixels; 0 for none.
        until: Where it ends: one of {share: of the run}, {steps: count}, {seconds: of training}; None: never.
        loss_weights: Weights of loss terms that this phase sets otherwise than `loss` does, by term.
    """

    rays: int
    surface_points: int
    square: int = 0
    until: Mapping[str, float] | None = None
    loss_weights: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.rays < 1:
            raise ConfigError(f"rays: found {self.rays}, expected at least 1 ray a step.")
        if self.surface_points < 0:
            raise ConfigError(f"surface_points: found {self.surface_points}, expected 0 or more.")
        if self.square < 0:
            raise ConfigError(f"square: found {self.square}, expected 0 or more pixels.")
        if self.until is None:
            return
        if len(self.until) != 1 or not set(self.until) <= set(UNITS):
            raise ConfigError(
                f"until: found {dict(self.until)}, expected one of {{share: ..}}, {{steps: ..}}, {{seconds:"
                " ..}."
            )
        unit, end = next(iter(self.until.items()))
        if not (0 < end < math.inf) or (unit == "share" and end >= 1):
            raise ConfigError(
                f"until.{unit}: found {end}, expected above 0{' and below 1' if unit == 'share' else ''}."
            )

    def is_over(self, *, step: int, seconds: float, progress: float) -> bool:
        """Whether the phase has ended before this step."""
        if self.until is None:
            return False
        now = {"share": progress, "steps": step, "seconds": seconds}
        return all(now[unit] >= end for unit, end in self.until.items())


@final
class PhaseSchedule:
    """The phases of a run, in order; the last one is open.

    Args:
        phases: At least one; every one but the last has `until`, the last has none. Ends in one unit ascend.

    Raises:
        ConfigError: If they do not.

    Source: paper, section "Mix of 2d ray sampling and 3d surface sampling" (1000 rays and 3000 points for
    four days, then 10000 and 10000 for three).
    """

    def __init__(self, *, phases: Sequence[Phase]) -> None:
        if not phases:
            raise ConfigError("schedule.phases: found none, expected at least one phase.")
        for index, phase in enumerate(phases[:-1]):
            if phase.until is None:
                raise ConfigError(
                    f"schedule.phases.{index}.until: not set, expected an end: only the last phase is open."
                )
        if phases[-1].until is not None:
            raise ConfigError(
                f"schedule.phases.{len(phases) - 1}.until: found {dict(phases[-1].until)}, expected none: the"
                " last phase lasts until the budget ends."
            )
        for unit in UNITS:
            ends = [phase.until[unit] for phase in phases if phase.until is not None and unit in phase.until]
            if any(later <= earlier for earlier, later in pairwise(ends)):
                raise ConfigError(f"schedule.phases: found ends {ends} in {unit}, expected them to ascend.")
        self.phases = tuple(phases)

    def __len__(self) -> int:
        """Number of phases."""
        return len(self.phases)

    def index_at(self, *, step: int, seconds: float, progress: float) -> int:
        """Index of the phase that a step belongs to.

        Args:
            step: Steps done before this one.
            seconds: Training seconds before this step, of all its resumed parts together, evaluation
                excluded.
            progress: Share of the budget that is used up before this step, in [0, 1].

        Returns:
            That of the first phase that has not ended; the last one never does.
        """
        index = 0
        while self.phases[index].is_over(step=step, seconds=seconds, progress=progress):
            index += 1
        return index


def progress_of_run(
    *, step: int, seconds: float, budget_steps: int | None, budget_seconds: float | None
) -> float:
    """Share of the budget used up, in [0, 1]: of steps or of seconds, whichever is larger; 0 without one."""
    fractions = [0.0]
    if budget_steps is not None:
        fractions.append(step / budget_steps)
    if budget_seconds is not None:
        fractions.append(seconds / budget_seconds)
    return min(1.0, max(fractions))
