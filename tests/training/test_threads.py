"""The number of threads of a step: the fastest of a machine whose seconds are known, in quiet, under load and after it."""

import pytest
import torch

from charnerf.training.threads import ThreadChoice, may_choose

IDLE = {1: 0.17, 2: 0.155}
LOADED = {1: 0.28, 2: 0.44}
THRASHED = {1: 0.28, 2: 4.0}


def train(choice: ThreadChoice, steps: int, seconds_of: dict[int, float], noise: float = 0.05) -> float:
    """Take steps; the seconds they took."""
    total = 0.0
    for _ in range(steps):
        seconds = seconds_of[choice.threads] * (1.0 + noise * float(torch.rand(()) - 0.5))
        total += seconds
        choice.step(seconds)
    return total


def test_idle_cores_are_used():
    choice = ThreadChoice(2)
    taken = train(choice, 1000, IDLE)
    assert choice.threads == 2
    assert taken < 1.02 * 1000 * IDLE[2]


@pytest.mark.parametrize("seconds_of", [LOADED, THRASHED])
def test_threads_that_wait_for_one_another_are_given_up(seconds_of):
    choice = ThreadChoice(2)
    taken = train(choice, 1000, seconds_of)
    assert choice.threads == 1
    assert taken < 1.05 * 1000 * seconds_of[1]


@pytest.mark.parametrize("seconds_of", [LOADED, THRASHED])
def test_load_that_comes_and_goes_is_noticed(seconds_of):
    choice = ThreadChoice(2)
    train(choice, 100, IDLE)
    assert train(choice, 100, seconds_of) < 100 * seconds_of[1] + 5 * seconds_of[2]
    assert choice.threads == 1
    train(choice, 40, IDLE)
    assert choice.threads == 2


def test_cores_that_are_free_from_the_start_of_a_load_on_are_found_by_time():
    """No jump shows that a second thread would pay: the steps by one thread are as they were."""
    choice = ThreadChoice(2)
    train(choice, 100, {1: 0.17, 2: 0.3})
    assert choice.threads == 1
    train(choice, 1000, IDLE)
    assert choice.threads == 2


@pytest.mark.parametrize("best", [1, 2, 4, 8, 12])
def test_the_best_of_many_is_found(best):
    choice = ThreadChoice(12)
    assert choice.candidates == [1, 3, 6, 12]
    seconds_of = {n: 0.1 * (1.0 + abs(n - best)) for n in choice.candidates}
    train(choice, 60, seconds_of, noise=0.0)
    assert seconds_of[choice.threads] == min(seconds_of.values())


def test_a_load_that_comes_during_a_trial_ends_it_with_a_choice():
    choice = ThreadChoice(2)
    train(choice, 5, IDLE)
    train(choice, 100, {1: 3.0, 2: 40.0})
    assert choice.threads == 1


def test_one_core_leaves_no_choice():
    choice = ThreadChoice(1)
    train(choice, 200, {1: 0.2})
    assert choice.threads == 1


def test_the_user_and_budgets_in_steps_fix_the_number(monkeypatch):
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    assert may_choose(budget_seconds=400.0)
    assert not may_choose(budget_seconds=None)
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert not may_choose(budget_seconds=400.0)
