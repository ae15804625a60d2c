"""Training in one process and in two, by the main command: seconds a step, and until a validation error is reached."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.threads import SMALL, TRAIN

STEPS, MARKS, ROUNDS = 40, 8, 2
TWICE = (
    "scale.batch_characters=2",
    "scale.phase_rays=[1024,2048]",
    "scale.phase_surface_points=[2048,2048]",
    "scale.space_points=1024",
)
WAYS = {
    "one process": ("trainer=cpu",),
    "one process, twice the batch": ("trainer=cpu", *TWICE),
    "two processes": ("trainer=ddp", "trainer.accelerator=cpu", "trainer.devices=2"),
}


@dataclass(frozen=True)
class Course:
    """Validations of a training.

    Attributes:
        seconds: Of training until each.
        decibels: PSNR on the foreground at each.
        steps: Taken in all.
    """

    seconds: tuple[float, ...]
    decibels: tuple[float, ...]
    steps: int

    def seconds_to(self, decibels: float) -> float:
        """Seconds until a validation reaches a PSNR; infinite if none does."""
        pairs = zip(self.seconds, self.decibels, strict=True)
        return min((seconds for seconds, reached in pairs if reached >= decibels), default=float("inf"))


def process_rows(say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Train by every way in turns; the error to reach is the best of the way that gets least far."""
    courses: dict[str, list[Course]] = {way: [] for way in WAYS}
    for turn in range(ROUNDS):
        for way, settings in WAYS.items():
            say(f"round {turn + 1} of {ROUNDS}: {way}")
            courses[way].append(trained(settings))
    goal = min(max(course.decibels) for each in courses.values() for course in each)
    return [
        {
            "training": way,
            "steps": each[0].steps,
            "seconds a step": median(course.seconds[-1] / course.steps for course in each),
            "dB at the end": median(course.decibels[-1] for course in each),
            "dB to reach": goal,
            "seconds to the error": median(course.seconds_to(goal) for course in each),
        }
        for way, each in courses.items()
    ]


def trained(settings: tuple[str, ...]) -> Course:
    """Train some steps with torch's own number of threads, and read the curve."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        budget = (f"budget.steps={STEPS}", "budget.seconds=null", f"hydra.run.dir={run}")
        marks = (f"validation.times={MARKS}", "validation.views=4")
        command = [sys.executable, str(TRAIN), *SMALL, *marks, *budget, *settings]
        subprocess.run(command, check=True, capture_output=True)
        with (run / "curve.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        steps = json.loads((run / "metrics.json").read_text(encoding="utf-8"))["steps"]
    return Course(
        tuple(float(row["seconds"]) for row in rows),
        tuple(float(row["val_psnr_foreground"]) for row in rows),
        int(steps),
    )
