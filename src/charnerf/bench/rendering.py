"""Renders a subject by every method: seconds, errors against the truth and against the converged reference, what was left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import torch
from torch import Tensor

from charnerf.bench.baseline import PixelNeRFLike
from charnerf.bench.subjects import Subject, pixels_psnr
from charnerf.bench.timing import Timing, in_turns
from charnerf.bench.workbench import BASELINE
from charnerf.types import ErrorEstimate, LeftOut, Rendering
from charnerf.volume.renderers.base import AbstractRenderer

LEAST_SECONDS = 0.1  # of one turn: faster methods are repeated within it


@dataclass(frozen=True)
class Measured:
    """One method on one subject.

    Attributes:
        seconds: Median of a call that renders all the subject's rays.
        rays_per_second: Rays over that.
        psnr: Against the truth, dB, over the random pixels.
        rms_error: Against the converged reference, root mean square over colours.
        max_error: Against the converged reference, the largest.
        left_out: Of the renderer; None of the baseline.
        estimate: What an adaptive renderer believed; None of others.
        timing: All of it.
    """

    seconds: float
    rays_per_second: float
    psnr: float
    rms_error: float
    max_error: float
    left_out: LeftOut | None
    estimate: ErrorEstimate | None
    timing: Timing

    def as_dict(self) -> dict[str, Any]:
        """Numbers for JSON."""
        numbers: dict[str, Any] = {
            "seconds": self.seconds,
            "seconds_low": self.timing.low,
            "seconds_high": self.timing.high,
            "repeats": self.timing.repeats,
            "rays_per_second": self.rays_per_second,
            "psnr": self.psnr,
            "rms_error": self.rms_error,
            "max_error": self.max_error,
        }
        if self.left_out is not None:
            numbers["left_out"] = self.left_out.shares()
        if self.estimate is not None:
            numbers["tolerance"] = {
                "asked": self.estimate.tolerance,
                "estimated": float(self.estimate.estimated.amax()),
                "true": self.max_error,
                "densities": self.estimate.num_samples,
                "colours": self.estimate.num_colors,
                "rays_stopped": self.estimate.num_stopped,
                "rays_unresolved": self.estimate.num_unresolved,
            }
        return numbers


def measure(
    subject: Subject,
    renderers: Mapping[str, AbstractRenderer],
    *,
    repeats: int,
    baseline: bool = True,
    reference: Tensor | None = None,
) -> dict[str, Measured]:
    """Time renderers, and the baseline, on a subject's rays, in turns and without gradient.

    Args:
        subject: What is rendered.
        renderers: By name.
        repeats: Turns.
        baseline: Whether the pixelNeRF-like evaluation takes part.
        reference: Colors (R, 3) that errors are taken against; the subject's converged ones if None.
    """
    methods: dict[str, Callable[[], Any]] = {}
    if baseline:
        methods[BASELINE] = partial(PixelNeRFLike(subject.network).render, subject.maps, subject.rays)
    for name, renderer in renderers.items():
        methods[name] = partial(renderer.render, renderer.prepared(subject.scene), subject.rays)
    with torch.no_grad():
        timings = in_turns(methods, repeats=repeats, device=subject.truth.device, least_seconds=LEAST_SECONDS)
    truth = subject.converged if reference is None else reference
    return {name: _assess(timing, subject, truth) for name, timing in timings.items()}


def _assess(timing: Timing, subject: Subject, reference: Tensor) -> Measured:
    answer = timing.answer
    is_rendering = isinstance(answer, Rendering)
    rgb = answer.finest.rgb if is_rendering else answer.rgb
    error = (rgb.double() - reference).abs()
    return Measured(
        seconds=timing.median,
        rays_per_second=len(rgb) / timing.median,
        psnr=pixels_psnr(rgb, subject.truth),
        rms_error=float(error.square().mean().sqrt()),
        max_error=float(error.amax()),
        left_out=answer.left_out if is_rendering else None,
        estimate=answer.estimate if is_rendering else None,
        timing=timing,
    )
