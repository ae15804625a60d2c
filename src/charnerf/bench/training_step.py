"""Seconds of a training step: packed samples in the hull against all samples, at an equal batch."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.bench.baseline import PixelAligned, PixelNeRFLike
from charnerf.bench.measure import Timing, in_turns
from charnerf.bench.subjects import Subject
from charnerf.models.charnerf import CharNeRF
from charnerf.types import RayBundle, RenderOutput
from charnerf.volume.renderers.base import AbstractRenderer

OPACITY_WEIGHT = 0.1  # of the default loss


@dataclass(frozen=True)
class Batch:
    """Rays (R,) of one character with their colours (R, 3) on white."""

    rays: RayBundle
    rgb: Tensor


def batch_of(subject: Subject, num_rays: int) -> Batch:
    """As many of the subject's pixels as a training step has rays, repeated where there are fewer."""
    index = torch.arange(num_rays, device=subject.truth.device) % len(subject.truth)
    return Batch(rays=subject.rays[index], rgb=subject.truth[index])


def step_timings(
    subject: Subject,
    batch: Batch,
    renderers: dict[str, AbstractRenderer],
    *,
    repeats: int,
    baseline: str,
) -> dict[str, Timing]:
    """Time training steps (encode, render, loss, gradient, Adam) with each renderer and with the baseline's evaluation.

    Every method trains a copy of its own, from the same weights; the hull is carved beforehand, as in
    training.

    Args:
        subject: The character.
        batch: Its rays.
        renderers: By name.
        repeats: Turns.
        baseline: Name under which the pixelNeRF-like evaluation takes part.
    """
    methods: dict[str, Callable[[], float]] = {}
    for name, renderer in renderers.items():
        methods[name] = _step(subject, batch, renderer)
    methods[baseline] = _step(subject, batch, None)
    return in_turns(methods, repeats=repeats, device=subject.truth.device)


def _step(subject: Subject, batch: Batch, renderer: AbstractRenderer | None) -> Callable[[], float]:
    network = copy.deepcopy(subject.network).requires_grad_(True).train()
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-4)
    with torch.no_grad():
        hull = network.carve(subject.views)
    generator = torch.Generator().manual_seed(0)

    def step() -> float:
        encoded = network.encode(subject.views, hull)
        if renderer is None:
            output = PixelNeRFLike(network).render(PixelAligned.of(encoded), batch.rays, generator)
        else:
            output = renderer.render(network.scene(encoded, 0), batch.rays, generator).finest
        loss = _loss(output, batch)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()
        return float(loss.detach())

    return step


def _loss(output: RenderOutput, batch: Batch) -> Tensor:
    """Colours, and opacity where the truth is not white."""
    seen = (batch.rgb < 1.0).any(-1).to(output.opacity.dtype)
    return (output.rgb - batch.rgb).square().mean() + OPACITY_WEIGHT * (output.opacity - seen).square().mean()


def parameters_of(network: CharNeRF) -> int:
    """Number of weights."""
    return sum(parameter.numel() for parameter in network.parameters())
