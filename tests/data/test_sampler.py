"""Which batch comes next: exact counts at exact batches, whatever the epochs and resumes between."""

from itertools import chain

import pytest
import torch

from charnerf.data.sampler import BatchRequest, PhaseSampler, RunPosition, step_seed
from charnerf.schedule import Phase, PhaseSchedule

LONG = 10


class Run:
    """A run of LONG steps that stands where it is told."""

    def __init__(self, step: int = 0) -> None:
        self.step = step

    def __call__(self, step: int | None = None) -> RunPosition:
        step = self.step if step is None else step
        return RunPosition(step=step, seconds=0.5 * step, progress=step / LONG)


def schedule(until: dict[str, float]) -> PhaseSchedule:
    few = Phase(rays=10, surface_points=30, until=until)
    many = Phase(rays=100, surface_points=0, loss_weights={"opacity": 0.5})
    return PhaseSchedule(phases=[few, many])


def epochs(
    run: Run, sampler: PhaseSampler, *, stop_at: int = LONG, ahead: int = 0
) -> list[list[BatchRequest]]:
    """Train as the trainer does: requests are made `ahead` of the steps, until the budget or a stop."""
    done: list[list[BatchRequest]] = []
    while run.step < min(stop_at, LONG):
        done.append([])
        waiting: list[BatchRequest] = []
        for request in chain(sampler, [None] * ahead):
            waiting += [request] if request is not None else []
            if len(waiting) > ahead or (request is None and waiting):
                done[-1].append(waiting.pop(0))
                run.step += 1
            if run.step >= stop_at:
                break
    return done


@pytest.mark.parametrize("until", [{"steps": 4}, {"share": 0.4}, {"seconds": 2.0}])
@pytest.mark.parametrize("num_marks", [1, 2, 3, 10])
@pytest.mark.parametrize("ahead", [0, 1, 3])
def test_counts_change_at_the_exact_batch(until, num_marks, ahead):
    """Also where the trainer asks for batches before it has done the steps of those it has."""
    run = Run()
    sampler = PhaseSampler(schedule=schedule(until), position=run, num_marks=num_marks)
    done = epochs(run, sampler, ahead=ahead)
    requests = [request for epoch in done for request in epoch]
    assert [request.step for request in requests] == list(range(LONG))
    assert [request.rays for request in requests] == [10] * 4 + [100] * 6
    assert [request.surface_points for request in requests] == [30] * 4 + [0] * 6
    assert [request.phase for request in requests] == [0] * 4 + [1] * 6
    assert [dict(request.loss_weights) for request in requests] == [{}] * 4 + [{"opacity": 0.5}] * 6
    assert len(done) == num_marks and all(done)


@pytest.mark.parametrize("stop_at", [2, 3, 4, 5, 7])
def test_a_resume_asks_for_the_same_batches(stop_at):
    straight, whole = Run(), schedule({"steps": 4})
    expected = epochs(straight, PhaseSampler(schedule=whole, position=straight, num_marks=2))
    first = Run()
    before = epochs(first, PhaseSampler(schedule=whole, position=first, num_marks=2), stop_at=stop_at)
    second = Run(stop_at)
    after = epochs(second, PhaseSampler(schedule=whole, position=second, num_marks=2))
    flat = lambda done: [request for epoch in done for request in epoch]  # noqa: E731
    assert flat(before) + flat(after) == flat(expected)


def test_an_epoch_ends_at_a_mark_and_a_used_up_budget_gives_none():
    run = Run()
    done = epochs(run, PhaseSampler(schedule=schedule({"steps": 4}), position=run, num_marks=4))
    assert [len(epoch) for epoch in done] == [3, 2, 3, 2]  # marks at 2.5, 5, 7.5, 10 steps
    assert list(PhaseSampler(schedule=schedule({"steps": 4}), position=Run(LONG), num_marks=4)) == []


def test_every_step_of_every_run_has_its_seed():
    """Torch's generator reads 32 bits of a seed: a run's seed in the bits above would change nothing."""
    runs, steps = (0, 1, 7, 20240229, 2**32 - 1), (0, 1, 5, 400_000)
    seeds = {step_seed(seed, step) for seed in runs for step in steps}
    assert len(seeds) == 20 and all(0 <= seed < 2**32 for seed in seeds)
    draws = {torch.rand(1, generator=torch.Generator().manual_seed(seed)).item() for seed in seeds}
    assert len(draws) == 20
    assert len({step_seed(0, step) for step in range(10_000)}) >= 9_999


def test_a_step_and_the_first_of_its_characters_have_seeds_of_their_own():
    """NumPy fills a short list of words with zeros: (0, 5) and (0, 5, 0) would be one seed."""
    places = [(5,), (5, 0), (5, 1), (5, 0, 0), (5, 0, 1), (0,), (0, 0)]
    assert len({step_seed(0, *place) for place in places}) == len(places)
