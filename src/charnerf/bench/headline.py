"""The headline: few numbers that say what leaving out is worth and what it costs, and how each was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from charnerf.bench.rendering import Measured, measure
from charnerf.bench.subjects import NUM_PIXELS, Subject
from charnerf.bench.training_step import batch_of, step_timings
from charnerf.bench.turntable import FRAMES, LOOK_SIDE, LOOKS, SIDE, turntable
from charnerf.bench.workbench import ADAPTIVE, BAKED, BASELINE, CULLED, TOLERANCE, Workbench

REFERENCE = "dense, float64, 1024 samples on every ray that meets the hull, hull looked up in 1024 steps"


@dataclass(frozen=True)
class Comparison:
    """Methods on one subject."""

    subject: Subject
    methods: dict[str, Measured]

    def speedup(self, name: str) -> float:
        """Rays a second over those of the baseline."""
        return self.methods[BASELINE].seconds / self.methods[name].seconds

    def as_dict(self) -> dict[str, Any]:
        """Numbers for JSON."""
        return {
            "name": self.subject.name,
            "rays": len(self.subject.truth),
            "speedup": {name: self.speedup(name) for name in self.methods if name != BASELINE},
            "methods": {name: measured.as_dict() for name, measured in self.methods.items()},
        }


def compare(bench: Workbench, subjects: Sequence[Subject], *, repeats: int = 3) -> list[Comparison]:
    """The baseline, culled, adaptive and baked on every subject."""
    chosen = {name: bench.renderers[name] for name in (CULLED, ADAPTIVE, BAKED)}
    return [Comparison(one, measure(one, chosen, repeats=repeats)) for one in subjects]


def headline(bench: Workbench, subjects: Sequence[Subject]) -> dict[str, Any]:
    """Measure rendering of all subjects, and a turntable and training steps of the first.

    Returns:
        "headline" with the numbers and how they were measured; what they summarise: "characters",
        "turntable", "training_step".
    """
    compared = compare(bench, subjects)
    batch = batch_of(subjects[0], bench.batch_rays)
    steps = step_timings(subjects[0], batch, bench.training, repeats=3)
    seconds = {name: taken.median for name, taken in steps.items()}
    rays_per_second = compared[0].methods[BASELINE].rays_per_second
    turned = turntable(subjects[0], bench.renderers[BAKED]).as_dict(rays_per_second)
    return {
        "headline": {
            "render_speedup_culled": median(one.speedup(CULLED) for one in compared),
            "render_speedup_adaptive": median(one.speedup(ADAPTIVE) for one in compared),
            "render_speedup_baked": median(one.speedup(BAKED) for one in compared),
            "render_psnr_loss_db": _psnr_loss(compared, ADAPTIVE),
            "render_max_error": max(one.methods[ADAPTIVE].max_error for one in compared),
            "baked_psnr_loss_db": _psnr_loss(compared, BAKED),
            "baked_max_error": max(one.methods[BAKED].max_error for one in compared),
            **{name: value for name, value in turned.items() if name != "turntable_seconds"},
            "train_speedup": seconds[BASELINE] / seconds[CULLED],
            "how": how(bench.batch_rays, len(subjects)),
        },
        "characters": [one.as_dict() for one in compared],
        "turntable": turned,
        "training_step": {"rays": bench.batch_rays, "seconds": seconds},
    }


def _psnr_loss(compared: Sequence[Comparison], name: str) -> float:
    """PSNR of the baseline minus that of a method, median over subjects, dB."""
    return median(one.methods[BASELINE].psnr - one.methods[name].psnr for one in compared)


def how(batch_rays: int, num_characters: int) -> dict[str, str]:
    """How each number of the headline was measured."""
    pixels = f"{NUM_PIXELS} seeded random pixels of one whole picture of each of {num_characters} characters"
    return {
        "render_speedup_culled": f"median over characters of the baseline's median seconds over renderer=culled's, {pixels}, "
        "in turns in one process; the baseline is the same network evaluated as pixelNeRF does: 64 samples a ray over the "
        "whole box, then these and 32 more (as its authors' code, also with one network: 160 evaluations; asking none twice would "
        "take 0.6 of its time), all views, grid_sample, linear maps at each point, 100,000 points at once",
        "render_speedup_adaptive": f"the same with renderer=adaptive, renderer.tolerance={TOLERANCE}",
        "render_psnr_loss_db": "PSNR of the baseline minus that of adaptive against the truth, on these pixels; median over "
        "characters; negative where adaptive is nearer to the truth",
        "render_max_error": f"largest error of a color of adaptive on these pixels against: {REFERENCE}",
        "render_speedup_baked": f"the same with renderer=baked, renderer.tolerance={TOLERANCE}; baked before",
        "baked_psnr_loss_db": "as render_psnr_loss_db, of baked",
        "baked_max_error": "as render_max_error, of baked",
        "turntable_speedup": f"{FRAMES} frames of {SIDE} pixels of the first character, baking included, over as many "
        "of the baseline at its rays a second on the random pixels: it spends as much on any other",
        "frames_per_second_256": f"of the median of {LOOKS} pictures of {LOOK_SIDE} pixels of the first character",
        "bake_seconds": "until the first character is ready to be looked at, encoding and hull excluded",
        "bake_mib": "of its grid",
        "train_speedup": f"seconds of a step (encoder, {batch_rays} random pixels, loss, gradient, Adam; hull "
        "carved before) that evaluates as the baseline over those of the packed culled step, equal batch; "
        "renderer=dense with the training's own samples a ray is in training_step",
    }
