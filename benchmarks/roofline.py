"""Arithmetic done a second against the matrix products that this machine manages at best."""

from __future__ import annotations

import time
from dataclasses import dataclass

import torch
from torch.utils.flop_counter import FlopCounterMode

from charnerf.bench.subjects import Subject
from charnerf.evaluation.timing import synchronize
from charnerf.volume.renderers.base import AbstractRenderer


def _flop_of_product(total: torch.Size, first: torch.Size, second: torch.Size, **_: object) -> int:
    """Arithmetic of `total.addmm_(first, second)` by the shapes."""
    return 2 * first[0] * first[1] * second[1]


IN_PLACE = {torch.ops.aten.addmm_: _flop_of_product}  # torch counts only products that are not in place


@dataclass(frozen=True)
class Roofline:
    """Share of the measured peak.

    Attributes:
        peak_gflops: Best float32 product of square matrices, GFLOP/s.
        achieved_gflops: Products and convolutions of the rendering over its seconds.
        share: Achieved over peak.
        gflop: Arithmetic of one rendering.
        seconds: Of one rendering.
    """

    peak_gflops: float
    achieved_gflops: float
    share: float
    gflop: float
    seconds: float


def matmul_seconds(side: int, device: torch.device) -> float:
    """Seconds of one product of two float32 matrices."""
    a, b = torch.ones(side, side, device=device), torch.ones(side, side, device=device)
    synchronize(device)
    start = time.perf_counter()
    torch.mm(a, b)
    synchronize(device)
    return time.perf_counter() - start


def roofline(subject: Subject, renderer: AbstractRenderer, *, rounds: int = 5, side: int = 2048) -> Roofline:
    """Render the subject's rays, and multiply matrices in turns with it; the best of both counts.

    The arithmetic is counted by torch from the shapes of products and convolutions; element-wise work,
    look-ups and sampling
    count as nothing.

    Args:
        subject: What is rendered.
        renderer: By which renderer.
        rounds: Turns.
        side: Of the matrices.
    """
    device = subject.truth.device
    with torch.no_grad():
        with FlopCounterMode(display=False, custom_mapping=IN_PLACE) as counter:
            renderer.render(subject.scene, subject.rays)
        flop = counter.get_total_flops()
        rendering, product = [], []
        matmul_seconds(side, device)
        for _ in range(rounds):
            product += [matmul_seconds(side, device) for _ in range(3)]
            synchronize(device)
            start = time.perf_counter()
            renderer.render(subject.scene, subject.rays)
            synchronize(device)
            rendering.append(time.perf_counter() - start)
    peak, achieved = 2.0 * side**3 / min(product), flop / min(rendering)
    return Roofline(peak / 1e9, achieved / 1e9, achieved / peak, flop / 1e9, min(rendering))
