"""Seconds of methods, taken in turns so that what else the machine does hits all of them."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any

import torch

from charnerf.evaluation.timing import synchronize


@dataclass(frozen=True)
class Timing:
    """Seconds of one method: median, least and greatest over repeats; and what it answered last."""

    median: float
    low: float
    high: float
    repeats: int
    answer: Any


def in_turns(
    methods: Mapping[str, Callable[[], Any]],
    *,
    repeats: int,
    device: torch.device,
    least_seconds: float = 0.0,
    most_seconds: float = math.inf,
) -> dict[str, Timing]:
    """Time methods in turns, after one call each to warm up.

    Args:
        methods: By name.
        repeats: Rounds.
        device: Waited for before and after each call.
        least_seconds: A method that is faster is called again within its turn until this time has passed,
            and its turn counts as the mean of these calls.
        most_seconds: A method whose turns have taken longer than this in sum takes no further one.
    """
    answers = {name: method() for name, method in methods.items()}
    seconds: dict[str, list[float]] = {name: [] for name in methods}
    for _ in range(repeats):
        for name, method in methods.items():
            if sum(seconds[name]) > most_seconds:
                continue
            synchronize(device)
            start, calls = time.perf_counter(), 0
            while True:
                answers[name] = method()
                calls += 1
                synchronize(device)
                passed = time.perf_counter() - start
                if passed >= least_seconds:
                    break
            seconds[name].append(passed / calls)
    return {
        name: Timing(median(taken), min(taken), max(taken), len(taken), answers[name])
        for name, taken in seconds.items()
    }
