"""Losses of training one character from seeded weights: packed samples in the hull against all samples, at an equal batch."""

from __future__ import annotations

from statistics import fmean, stdev
from typing import Any

import torch

from charnerf.bench.subjects import Subject
from charnerf.bench.training_step import Batch, trainer
from charnerf.bench.workbench import BASELINE
from charnerf.volume.renderers.base import AbstractRenderer


def loss_curves(
    subject: Subject,
    renderers: dict[str, AbstractRenderer],
    *,
    num_rays: int,
    steps: int,
    seeds: int,
    rate: float,
) -> dict[str, list[list[float]]]:
    """Losses by method, seed and step; with one seed all methods see the same batches.

    Args:
        subject: The character; its rays are drawn from.
        renderers: By name.
        num_rays: Rays of a batch.
        steps: Batches.
        seeds: Of batches and jitter, from 0.
        rate: Learning rate.
    """
    curves: dict[str, list[list[float]]] = {}
    for name, renderer in {**renderers, BASELINE: None}.items():
        curves[name] = []
        for seed in range(seeds):
            step = trainer(subject, renderer, rate=rate, seed=seed)
            draws = torch.Generator().manual_seed(seed)
            losses = []
            for _ in range(steps):
                index = torch.randint(len(subject.truth), (num_rays,), generator=draws).to(
                    subject.truth.device
                )
                losses.append(step(Batch(rays=subject.rays[index], rgb=subject.truth[index])))
            curves[name].append(losses)
    return curves


def compared_curves(curves: dict[str, list[list[float]]]) -> list[dict[str, Any]]:
    """Rows of each method: its mean loss over the last third of the steps, and how far it is from the baseline's.

    The noise is the spread (standard deviation) of that mean between seeds, of method and baseline together.
    """
    last = {
        name: [fmean(losses[-max(1, len(losses) // 3) :]) for losses in of_seeds]
        for name, of_seeds in curves.items()
    }
    rows = []
    for name, values in last.items():
        apart = fmean(values) - fmean(last[BASELINE])
        noise = max(_spread(values), _spread(last[BASELINE]))
        rows.append(
            {
                "method": name,
                "first loss": fmean(losses[0] for losses in curves[name]),
                "last third": fmean(values),
                "off the baseline": apart,
                "spread of seeds": noise,
                "within it": abs(apart) <= noise,
            }
        )
    return rows


def _spread(values: list[float]) -> float:
    return stdev(values) if len(values) > 1 else 0.0
