"""Memory of a process that does the same with a character again and again: loads, encodes and renders it, or opens it baked."""

from __future__ import annotations

import gc
import multiprocessing
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import torch

from charnerf.bench.subjects import Pictured
from charnerf.evaluation.timing import resident_mib
from charnerf.inference import weights
from charnerf.inference.baked_file import load_baked, save_baked
from charnerf.inference.hero import Hero

ROUNDS = 500
WARM, WINDOW = 10, 20  # rounds before the first that counts, and in a median
SIZE = 96  # pixels


def repeat_rows(source: Path, pictured: Pictured, *, rounds: int) -> list[dict[str, Any]]:
    """Resident memory, MiB, over rounds, each way in a fresh process; one round swings by some MiB: medians of 20 are compared."""
    return [_row(name, _fresh(way, source, pictured, rounds), rounds) for name, way in WAYS.items()]


def _row(name: str, measured: tuple[list[float], list[int]], rounds: int) -> dict[str, Any]:
    resident, held = measured
    warm, last = resident[WARM : WARM + WINDOW], resident[-WINDOW:]
    return {
        "again and again": name,
        "rounds": rounds,
        "MiB after one": resident[0],
        f"MiB after {WARM}": median(warm),
        "MiB at the end": median(last),
        "growth": median(last) / median(warm) - 1.0,
        "largest": max(resident),
        "tensors more": held[-1] - held[0],
    }


def _fresh(
    way: Callable[[Path, Pictured, Path], Callable[[], Hero]], source: Path, pictured: Pictured, rounds: int
) -> tuple[list[float], list[int]]:
    with multiprocessing.get_context("spawn").Pool(1) as pool, tempfile.TemporaryDirectory() as folder:
        return pool.apply(_repeat, (way, source, pictured, Path(folder), rounds))


def _repeat(
    way: Callable[[Path, Pictured, Path], Callable[[], Hero]],
    source: Path,
    pictured: Pictured,
    folder: Path,
    rounds: int,
) -> tuple[list[float], list[int]]:
    """Resident memory after each round, MiB, and how many tensors are held after some and after all."""
    resident, held = [], []
    begin = way(source, pictured, folder)
    for turn in range(rounds):
        begin().render(azimuth_deg=(30.0 * turn) % 360.0, size=SIZE)
        resident.append(resident_mib() or 0.0)
        if turn in (WARM, rounds - 1):
            held.append(_tensors())
    return resident, held


def _encoded(source: Path, pictured: Pictured, folder: Path) -> Callable[[], Hero]:
    return lambda: weights.load(source).encode_views(pictured.views)


def _baked(source: Path, pictured: Pictured, folder: Path) -> Callable[[], Hero]:
    file = save_baked(folder / "baked.safetensors", weights.load(source).encode_views(pictured.views).baked())
    return lambda: load_baked(file)


WAYS = {"load, encode, render": _encoded, "load baked, render": _baked}


def _tensors() -> int:
    """How many tensors are held; objects that refer to one another in circles are freed first."""
    gc.collect()
    return sum(isinstance(one, torch.Tensor) for one in gc.get_objects())
