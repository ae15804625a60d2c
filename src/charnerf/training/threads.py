"""How many threads a training step is taken with, chosen by the seconds that steps take.

Threads of one step wait for one another hundreds of times. On idle cores two are faster than one; beside other
processes each wait may last until the awaited thread gets its core back, and two are several times slower than one.
"""

import os
import time
from collections import Counter
from statistics import median
from typing import Any, final

import lightning as L
import torch

FIXED_BY = ("OMP_NUM_THREADS", "MKL_NUM_THREADS")
ROUNDS = 3  # of a trial, in each of which every number of threads takes two steps; the second counts
TOO_SLOW = 2.0  # times the best: one step is enough to leave a number of threads out of a trial
SLOWER = 1.25  # times the best: a round is enough
JUMP = 1.5  # two steps in a row that differ by this factor from the usual end the choice
REST_SECONDS = 30.0  # from one trial to the next, at least
REST = 50.0  # times the seconds that the last trial lost: trials cost two hundredths of the time at most
MEMORY = 0.05  # weight of the newest step in the usual seconds


@final
class ThreadChoice:
    """The number of threads of the next step, from the seconds of those before.

    A trial takes steps by all candidates in turns and keeps the fastest. The next trial comes when steps become
    slower while there are fewer threads to choose, or faster while there are more, and from time to time.

    Args:
        most: Threads at most. Candidates are this number, its half and so on down to 1.
    """

    def __init__(self, most: int) -> None:
        self.candidates = sorted({max(1, most >> halvings) for halvings in range(most.bit_length())})
        self.threads = self.candidates[0]
        self._rest = 0.0  # seconds until the next trial
        self._usual = 0.0  # seconds of a step by the chosen number; 0 during a trial
        self._jumps = 0
        self._begin_trial()

    def step(self, seconds: float) -> int:
        """Number of threads for the next step.

        Args:
            seconds: Of the step just taken by `threads`.
        """
        if self._usual:
            self._watch(seconds)
        else:
            self._try(seconds)
        return self.threads

    def _begin_trial(self) -> None:
        self._usual, self._jumps, self._round = 0.0, 0, 0
        self._left = list(self.candidates)  # still in the trial
        self._counted: dict[int, list[float]] = {threads: [] for threads in self.candidates}
        self._all: list[float] = []
        self._place, self._warm = 0, False
        self.threads = self._left[0]

    def _try(self, seconds: float) -> None:
        self._all.append(seconds)
        best = min((median(taken) for taken in self._counted.values() if taken), default=seconds)
        if seconds > TOO_SLOW * best and len(self._left) > 1:
            self._left.remove(self.threads)
        elif not self._warm:  # the first step after a change
            self._warm = True
            return
        else:
            self._counted[self.threads].append(seconds)
            self._place += 1
        self._warm = False
        if self._place >= len(self._left):
            self._end_round()
        if not self._usual:
            self.threads = self._left[self._place]

    def _end_round(self) -> None:
        """Leave out what is slower; end the trial after the last round, or where one is left."""
        self._place = 0
        self._round += 1
        middle = {threads: median(self._counted[threads]) for threads in self._left}
        best = min(middle.values())
        self._left = [threads for threads in self._left if middle[threads] <= SLOWER * best]
        if self._round < ROUNDS and len(self._left) > 1:
            return
        self.threads = min(self._left, key=lambda threads: middle[threads])
        self._usual = middle[self.threads]
        lost = sum(max(0.0, seconds - self._usual) for seconds in self._all)
        self._rest = max(REST_SECONDS, REST * lost)

    def _watch(self, seconds: float) -> None:
        self._rest -= seconds
        slower = seconds > JUMP * self._usual and self.threads > self.candidates[0]
        faster = seconds < self._usual / JUMP and self.threads < self.candidates[-1]
        self._jumps = self._jumps + 1 if slower or faster else 0
        if not self._jumps:
            self._usual += MEMORY * (seconds - self._usual)
        if self._jumps == 2 or self._rest <= 0.0:
            self._begin_trial()


@final
class ThreadTuner(L.Callback):
    """Takes the training steps on a CPU with the number of threads that is fastest at the time; else counts them alone.

    Args:
        adapts: Whether to choose; else all steps are taken with torch's own number.
    """

    def __init__(self, *, adapts: bool) -> None:
        self.adapts = adapts
        self.steps_by_threads: Counter[int] = Counter()
        self._choice: ThreadChoice | None = None
        self._start = 0.0

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        """Begin with one thread, which waits for no other."""
        if self.adapts and trainer.strategy.root_device.type == "cpu":
            self._choice = ThreadChoice(torch.get_num_threads())
            torch.set_num_threads(self._choice.threads)

    def on_train_batch_start(self, *_: Any) -> None:
        """Read the clock."""
        self._start = time.perf_counter()

    def on_train_batch_end(self, *_: Any) -> None:
        """Choose for the next step."""
        self.steps_by_threads[torch.get_num_threads()] += 1
        if self._choice is not None:
            torch.set_num_threads(self._choice.step(time.perf_counter() - self._start))


def may_choose(*, budget_seconds: float | None) -> bool:
    """Whether steps may be taken with a number of threads that their seconds decide.

    Rounding hangs on the number of threads: a seed gives the same numbers only with the same number. Not so where the
    budget is in steps alone, then; with one in seconds, time decides on the steps anyhow. And OMP_NUM_THREADS or
    MKL_NUM_THREADS, where set, are the user's choice.
    """
    return budget_seconds is not None and not any(name in os.environ for name in FIXED_BY)
