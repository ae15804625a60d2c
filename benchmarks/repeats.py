"""Memory of a process that loads the model, encodes a character and renders it again and again."""

from __future__ import annotations

import gc
import multiprocessing
from pathlib import Path
from statistics import median
from typing import Any

import torch

from charnerf.bench.subjects import Pictured
from charnerf.evaluation.timing import resident_mib
from charnerf.inference import weights

ROUNDS = 300
WARM, WINDOW = 10, 20  # rounds before the first that counts, and in a median
SIZE = 96  # pixels


def repeat_row(source: Path, pictured: Pictured, *, rounds: int) -> dict[str, Any]:
    """Resident memory, MiB, over rounds in a fresh process; one round swings by some MiB, so medians of 20 are compared."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        resident, held = pool.apply(_repeat, (source, pictured, rounds))
    warm, last = resident[WARM : WARM + WINDOW], resident[-WINDOW:]
    return {
        "rounds": rounds,
        "MiB after one": resident[0],
        f"MiB after {WARM}": median(warm),
        "MiB at the end": median(last),
        "growth": median(last) / median(warm) - 1.0,
        "largest": max(resident),
        "tensors more": held[-1] - held[0],
    }


def _repeat(source: Path, pictured: Pictured, rounds: int) -> tuple[list[float], list[int]]:
    """Resident memory after each round, MiB, and how many tensors are held after some and after all."""
    resident, held = [], []
    for turn in range(rounds):
        hero = weights.load(source).encode_views(pictured.views)
        hero.render(azimuth_deg=(30.0 * turn) % 360.0, size=SIZE)
        del hero
        resident.append(resident_mib() or 0.0)
        if turn in (WARM, rounds - 1):
            held.append(_tensors())
    return resident, held


def _tensors() -> int:
    """How many tensors are held; objects that refer to one another in circles are freed first."""
    gc.collect()
    return sum(isinstance(one, torch.Tensor) for one in gc.get_objects())
