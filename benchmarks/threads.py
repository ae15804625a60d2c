"""Steps a second of the main command on idle cores and beside one busy process a core, by how threads are chosen."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any

from charnerf.training.threads import FIXED_BY

TRAIN = Path(__file__).resolve().parents[1] / "train.py"
SECONDS, ROUNDS = 30, 3
SMALL = (  # of all but the steps
    "data.train=8",
    "data.val=1",
    "data.test=1",
    "validation.times=1",
    "validation.views=1",
    "scale.eval_views=1",
    "scale.mesh_resolution=32",
)
BUSY = "while True: pass"


def thread_rows(say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Medians over rounds in which every way takes its turn, idle and loaded; by the cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    choices = {"chosen while training": None, f"{cores} always": cores, "1 always": 1}
    steps: dict[tuple[str, bool], list[float]] = {
        (way, loaded): [] for way in choices for loaded in (False, True)
    }
    for turn in range(ROUNDS):
        for way, threads in choices.items():
            for loaded in (False, True):
                say(f"round {turn + 1} of {ROUNDS}: {way}, {'loaded' if loaded else 'idle'}")
                with busy(cores if loaded else 0):
                    steps[way, loaded].append(steps_a_second(threads))
    idle = median(steps[f"{cores} always", False])
    return [
        {
            "threads": way,
            "cores": cores,
            "steps/s idle": median(steps[way, False]),
            "steps/s loaded": median(steps[way, True]),
            "least loaded": min(steps[way, True]),
            "loaded over the old way's idle": median(steps[way, True]) / idle,
        }
        for way in choices
    ]


def steps_a_second(threads: int | None) -> float:
    """Train at scale=small for some seconds by `train.py`; a number of threads is fixed as a user does it."""
    environment = {name: value for name, value in os.environ.items() if name not in FIXED_BY}
    if threads is not None:
        environment["OMP_NUM_THREADS"] = str(threads)
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        command = [sys.executable, str(TRAIN), "trainer=cpu", f"budget.seconds={SECONDS}", *SMALL]
        command.append(f"hydra.run.dir={run}")
        subprocess.run(command, env=environment, check=True, capture_output=True)
        metrics = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
    return float(metrics["steps"] / metrics["seconds"]["train"])


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep so many processes busy beside what is measured."""
    loops = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
