"""Seconds and losses of training steps: packed samples in the hull against all samples, at an equal batch."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import torch
from torch import Tensor

from charnerf.bench.baseline import PixelAligned, PixelNeRFLike
from charnerf.bench.subjects import Subject
from charnerf.bench.timing import Timing, in_turns
from charnerf.bench.workbench import BASELINE
from charnerf.models.charnerf import CharNeRF, EncodedViews
from charnerf.types import RayBundle, RenderOutput
from charnerf.volume.renderers.base import AbstractRenderer

OPACITY_WEIGHT = 0.1  # of the default loss
SLICE_RAYS = 128  # of the baseline: 20,480 samples; larger slices need more memory and are no faster on a CPU


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
) -> dict[str, Timing]:
    """Time training steps (encode, render, loss, gradient, Adam) with each renderer and with the baseline's evaluation.

    Every method trains a copy of its own, from the same weights; the hull is carved beforehand, as in
    training.

    Args:
        subject: The character.
        batch: Its rays.
        renderers: By name.
        repeats: Turns.
    """
    steps = {name: trainer(subject, renderer) for name, renderer in {**renderers, BASELINE: None}.items()}
    methods = {name: partial(step, batch) for name, step in steps.items()}
    return in_turns(methods, repeats=repeats, device=subject.truth.device)


def trainer(
    subject: Subject, renderer: AbstractRenderer | None, *, rate: float = 1e-4, seed: int = 0
) -> Callable[[Batch], float]:
    """A step (encode, render, loss, gradient, Adam) of a copy of the subject's network; answers its loss.

    Args:
        subject: The character and the network.
        renderer: By which renderer; None evaluates as the baseline.
        rate: Learning rate.
        seed: Of the samples' jitter.
    """
    network = copy.deepcopy(subject.network).requires_grad_(True).train()
    optimizer = torch.optim.Adam(network.parameters(), lr=rate)
    with torch.no_grad():
        hull = network.carve(subject.views)
    generator = torch.Generator().manual_seed(seed)

    def step(batch: Batch) -> float:
        optimizer.zero_grad(set_to_none=True)
        encoded = network.encode(subject.views, hull)
        if renderer is None:
            loss = _slice_by_slice(network, encoded, batch, generator)
        else:
            total = _loss(renderer.render(network.scene(encoded, 0), batch.rays, generator).finest, batch)
            total.backward()
            loss = float(total.detach())
        optimizer.step()
        return loss

    return step


def _slice_by_slice(
    network: CharNeRF, encoded: EncodedViews, batch: Batch, generator: torch.Generator
) -> float:
    """The baseline's loss and gradient, some rays at a time: all samples of a whole batch would fill the memory."""
    maps = encoded.feature_maps.detach().requires_grad_()
    read = PixelAligned.of(replace(encoded, feature_maps=maps))
    count, loss = len(batch.rgb), 0.0
    for start in range(0, count, SLICE_RAYS):
        some = slice(start, start + SLICE_RAYS)
        part = Batch(rays=batch.rays[some], rgb=batch.rgb[some])
        output = PixelNeRFLike(network).render(read, part.rays, generator)
        share = _loss(output, part) * (len(part.rgb) / count)
        share.backward()
        loss += float(share.detach())
    assert maps.grad is not None
    encoded.feature_maps.backward(maps.grad)
    return loss


def _loss(output: RenderOutput, batch: Batch) -> Tensor:
    """Colours, and opacity where the truth is not white."""
    seen = (batch.rgb < 1.0).any(-1).to(output.opacity.dtype)
    return (output.rgb - batch.rgb).square().mean() + OPACITY_WEIGHT * (output.opacity - seen).square().mean()
