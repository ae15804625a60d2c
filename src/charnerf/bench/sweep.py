"""Sweeps of one setting at a time: each row is a point of a work-precision diagram."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import torch
from torch import Tensor

from charnerf.bench.baseline import PixelNeRFLike
from charnerf.bench.subjects import Subject, pixels_psnr
from charnerf.bench.timing import in_turns
from charnerf.bench.workbench import ADAPTIVE, BAKED, BASELINE, CULLED, DENSE, TOLERANCE, Workbench
from charnerf.types import Rendering
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.baked import BakedRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer

Method = Callable[[Subject], Callable[[], Any]]
SAMPLES = (4, 8, 16, 32, 64, 128)
DENSE_SAMPLES = (4, 8, 16, 32)
BASELINE_SAMPLES = ((16, 8), (32, 16), (64, 32), (128, 64))
SLOW_SECONDS = 1.0  # of a method's turns in sum, after which it takes no further one
TOLERANCES = (0.2, 0.1, 0.05, 0.02, 0.01)
FACTORS = (1, 2, 3)  # steps of the baked grid in a pixel of the drawings
BAKED_TOLERANCES = (0.15, 0.02)  # beside its own


@dataclass(frozen=True)
class Row:
    """One setting of one method, over subjects.

    Attributes:
        curve: Method: a curve of the diagram.
        setting: What was set.
        seconds: Median over subjects of the median seconds of a call for all the subject's rays.
        spread: Greatest over least of the seconds of a subject's turns, the largest of all subjects.
        rms_error: Against the converged references, over all subjects' colours.
        max_error: The largest.
        psnr: Against the truth, mean over subjects, dB.
    """

    curve: str
    setting: str
    seconds: float
    spread: float
    rms_error: float
    max_error: float
    psnr: float


def sweep(
    methods: Mapping[tuple[str, str], Method],
    subjects: Sequence[Subject],
    *,
    repeats: int,
) -> list[Row]:
    """Measure methods, by (curve, setting), on subjects."""
    seconds: dict[tuple[str, str], list[float]] = {key: [] for key in methods}
    spreads: dict[tuple[str, str], list[float]] = {key: [] for key in methods}
    errors: dict[tuple[str, str], list[Tensor]] = {key: [] for key in methods}
    psnrs: dict[tuple[str, str], list[float]] = {key: [] for key in methods}
    for subject in subjects:
        with torch.no_grad():
            calls = {"\n".join(key): method(subject) for key, method in methods.items()}
            timings = in_turns(calls, repeats=repeats, device=subject.truth.device, most_seconds=SLOW_SECONDS)
        for name, timing in timings.items():
            curve, setting = name.split("\n")
            answer = timing.answer.finest.rgb if isinstance(timing.answer, Rendering) else timing.answer.rgb
            seconds[curve, setting].append(timing.median)
            spreads[curve, setting].append(timing.high / timing.low)
            errors[curve, setting].append((answer.double() - subject.converged).abs())
            psnrs[curve, setting].append(pixels_psnr(answer, subject.truth))
    return [
        Row(
            curve=key[0],
            setting=key[1],
            seconds=median(seconds[key]),
            spread=max(spreads[key]),
            rms_error=float(torch.cat(errors[key]).square().mean().sqrt()),
            max_error=float(torch.cat(errors[key]).amax()),
            psnr=sum(psnrs[key]) / len(psnrs[key]),
        )
        for key in methods
    ]


def sample_methods(bench: Workbench) -> dict[tuple[str, str], Method]:
    """Samples a ray: the baseline, dense, culled; adaptive by tolerance; baked by step and tolerance, without the baking."""
    like = bench.like
    methods: dict[tuple[str, str], Method] = {}
    for coarse, fine in BASELINE_SAMPLES:
        methods[BASELINE, f"{coarse} + {fine}"] = partial(_baseline, coarse, fine)
    for count in DENSE_SAMPLES:
        methods[DENSE, str(count)] = partial(rendered_by, DenseRenderer(**{**like, "num_coarse": count}))
    for count in SAMPLES:
        methods[CULLED, str(count)] = partial(rendered_by, CulledRenderer(**{**like, "num_coarse": count}))
    for tolerance in TOLERANCES:
        adaptive = AdaptiveRenderer(**like, tolerance=tolerance)
        methods[ADAPTIVE, f"tolerance {tolerance:g}"] = partial(rendered_by, adaptive)
    for factor in FACTORS:
        baked = BakedRenderer(**like, tolerance=TOLERANCE, factor=factor)
        methods[BAKED, f"1/{factor} pixel"] = partial(rendered_by, baked)
    for tolerance in BAKED_TOLERANCES:
        baked = BakedRenderer(**like, tolerance=tolerance)
        methods[BAKED, f"tolerance {tolerance:g}"] = partial(rendered_by, baked)
    return methods


def _baseline(coarse: int, fine: int, subject: Subject) -> Callable[[], Any]:
    method = PixelNeRFLike(subject.network, num_coarse=coarse, num_fine=fine)
    return partial(method.render, subject.maps, subject.rays)


def rendered_by(renderer: Any, subject: Subject) -> Callable[[], Any]:
    """The call that renders a subject's rays."""
    return partial(renderer.render, renderer.prepared(subject.scene), subject.rays)


def pareto(rows: Sequence[Row]) -> list[Row]:
    """Rows that no other beats in both seconds and error, fastest first."""
    front: list[Row] = []
    for row in sorted(rows, key=lambda one: (one.seconds, one.rms_error)):
        if not front or row.rms_error < front[-1].rms_error:
            front.append(row)
    return front
