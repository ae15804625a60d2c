"""The headline: few numbers that say what leaving out is worth and what it costs, and how each was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from torch import Tensor

from charnerf.bench.grids import GridShare, grid_share
from charnerf.bench.memory import peak_memory
from charnerf.bench.rendering import BASELINE, Measured, measure
from charnerf.bench.roofline import Roofline, roofline
from charnerf.bench.subjects import Pictured, Subject, reference, subject, subjects_by_kind, untrained_like
from charnerf.bench.training_step import batch_of, step_timings
from charnerf.models.charnerf import CharNeRF
from charnerf.volume.renderers.base import AbstractRenderer

NUM_PIXELS = 512
CULLED, ADAPTIVE, DENSE = "culled", "adaptive", "dense"
MIB_DEFAULT = 2048.0


@dataclass(frozen=True)
class Workbench:
    """What is measured.

    Attributes:
        network: The trained network.
        wide: A network of width 512 with seeded weights.
        like: Arguments that every renderer takes.
        renderers: culled, adaptive and dense, in evaluation.
        training: culled and dense with the training's number of samples.
        batch_rays: Rays of a training step.
        memory_mib: Budget that peaks are held against, MiB.
        image_size: Of the drawings, pixels.
    """

    network: CharNeRF
    wide: CharNeRF
    like: dict[str, Any]
    renderers: dict[str, AbstractRenderer]
    training: dict[str, AbstractRenderer]
    batch_rays: int
    memory_mib: float
    image_size: int


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
            "kind": self.subject.kind,
            "rays": len(self.subject.truth),
            "speedup": {name: self.speedup(name) for name in self.methods if name != BASELINE},
            "methods": {name: found.as_dict() for name, found in self.methods.items()},
        }


Referenced = tuple[Subject, Tensor]  # with its converged colours (R, 3)


def prepared_characters(bench: Workbench, pictured: Sequence[Pictured]) -> list[Referenced]:
    """Encode characters, choose their pixels, and compute what all errors are measured against."""
    subjects = [
        subject(one, bench.network, kind="character", num_pixels=NUM_PIXELS, seed=i)
        for i, one in enumerate(pictured)
    ]
    return [(one, reference(one)) for one in subjects]


def prepared_kinds(bench: Workbench) -> list[Referenced]:
    """The same of every kind of scene."""
    fog = untrained_like(bench.network)
    kinds = subjects_by_kind(bench.network, fog, size=bench.image_size, num_pixels=NUM_PIXELS)
    return [(one, reference(one)) for one in kinds]


def quick(
    bench: Workbench,
    pictured: Sequence[Pictured],
    characters: Sequence[Referenced],
    kinds: Sequence[Referenced],
    say: Callable[[str], None],
) -> dict[str, Any]:
    """Measure the headline and the kinds of scene; under five minutes on two cores.

    Args:
        bench: What is measured.
        pictured: Characters, drawings and a target picture each.
        characters: The same with references.
        kinds: Kinds of scene with references.
        say: Told what is being done.
    """
    chosen = {name: bench.renderers[name] for name in (CULLED, ADAPTIVE)}
    subjects = [one for one, _ in characters]
    say("characters")
    compared = [Comparison(one, measure(one, chosen, truth, repeats=3)) for one, truth in characters]
    say("kinds of scene")
    by_kind = [Comparison(one, measure(one, chosen, truth, repeats=2)) for one, truth in kinds]
    say("training steps")
    steps = step_timings(
        subjects[0],
        batch_of(subjects[0], bench.batch_rays),
        bench.training,
        repeats=3,
        baseline=BASELINE,
    )
    say("grids")
    grids = [grid_share(one, cells=256, num_cameras=8) for one in subjects]
    say("arithmetic")
    wide = subject(pictured[0], bench.wide, kind="width 512", num_pixels=NUM_PIXELS)
    arithmetic = roofline(wide, bench.renderers[CULLED])
    say("memory")
    render = peak_memory("render", bench.network, bench.renderers[ADAPTIVE], pictured[0], size=512)
    mesh = peak_memory("mesh", bench.network, bench.renderers[ADAPTIVE], pictured[0], size=512)
    step_seconds = {name: taken.median for name, taken in steps.items()}
    return {
        "headline": {
            **_rendering(compared, by_kind),
            "train_speedup_over_dense": step_seconds[BASELINE] / step_seconds[CULLED],
            **_grids(grids),
            "matmul_peak_share": arithmetic.share,
            "peak_memory_render_512_mib": render.rise_mib,
            "peak_memory_mesh_512_mib": mesh.rise_mib,
            "memory_budget_mib": bench.memory_mib,
            "how": how(bench, len(pictured), arithmetic),
        },
        "characters": [one.as_dict() for one in compared],
        "kinds": [one.as_dict() for one in by_kind],
        "training_step": {
            "rays": bench.batch_rays,
            "seconds": step_seconds,
            "speedup_over": {name: seconds / step_seconds[CULLED] for name, seconds in step_seconds.items()},
        },
        "grids": [one.as_dict() for one in grids],
        "roofline": arithmetic.as_dict(),
        "memory": {"render_512": render.as_dict(), "mesh_512": mesh.as_dict()},
    }


def _rendering(compared: Sequence[Comparison], by_kind: Sequence[Comparison]) -> dict[str, Any]:
    losses = [one.methods[BASELINE].psnr - one.methods[ADAPTIVE].psnr for one in compared]
    slowest = min(by_kind, key=lambda one: one.speedup(ADAPTIVE))
    wrongest = max(by_kind, key=lambda one: one.methods[ADAPTIVE].max_error)
    return {
        "render_speedup_culled": median(one.speedup(CULLED) for one in compared),
        "render_speedup_adaptive": median(one.speedup(ADAPTIVE) for one in compared),
        "render_psnr_loss_db": median(losses),
        "render_max_error": max(one.methods[ADAPTIVE].max_error for one in [*compared, *by_kind]),
        "worst_kind": {
            "slowest": slowest.subject.kind,
            "render_speedup_adaptive": slowest.speedup(ADAPTIVE),
            "least_accurate": wrongest.subject.kind,
            "render_max_error": wrongest.methods[ADAPTIVE].max_error,
        },
    }


def _grids(grids: Sequence[GridShare]) -> dict[str, Any]:
    return {
        "grid_share_256": median(one.share for one in grids),
        "grid_same_mesh": all(one.same for one in grids),
    }


def how(bench: Workbench, count: int, arithmetic: Roofline) -> dict[str, str]:
    """How each number of the headline was measured."""
    pixels = f"{NUM_PIXELS} seeded random pixels of one whole picture of each of {count} characters"
    tolerance = getattr(bench.renderers[ADAPTIVE], "tolerance", None)
    reference_ = "dense, float64, 1024 samples on every ray that meets the hull, hull looked up in 1024 steps"
    return {
        "render_speedup_culled": f"median over characters of the baseline's median seconds over renderer=culled's, {pixels}, "
        "in turns in one process; the baseline is the same network evaluated as pixelNeRF does: 64 samples a ray over the "
        "whole box, then these and 32 more (as its authors' code, also with one network: 160 evaluations; asking none twice would "
        "take 0.6 of its time), all views, grid_sample, linear maps at each point, 100,000 points at once",
        "render_speedup_adaptive": f"the same with renderer=adaptive, renderer.tolerance={tolerance}",
        "render_psnr_loss_db": "PSNR of the baseline minus that of adaptive against the truth, on these pixels; median over "
        "characters; negative where adaptive is nearer to the truth",
        "render_max_error": f"largest error of a colour of adaptive on characters and kinds of scene against: {reference_}",
        "worst_kind": "among compact body, thin blade and hair, wings and cape, white on white, fog, empty picture",
        "train_speedup_over_dense": f"seconds of a step (encoder, {bench.batch_rays} random pixels, loss, gradient, Adam; hull "
        "carved before) that evaluates as the baseline over those of the packed culled step, equal batch; "
        "renderer=dense with the training's own samples a ray is in training_step",
        "grid_share_256": "distinct grid points evaluated over 257^3 in a cube of side 2.2 m, 8 cameras; median over characters",
        "grid_same_mesh": "against all points inside the hull: same faces, or Hausdorff distance of vertices below 1e-4 m, on all "
        "characters",
        "matmul_peak_share": "products and convolutions counted by torch while culled renders the pixels with a network of width "
        f"512 with seeded weights, over the best of them timed, over the best of {arithmetic.peak_gflops:.0f} GFLOP/s by square "
        "products of side 2048",
        "peak_memory_render_512_mib": "rise of resident memory over the loaded, encoded model while adaptive renders 512 x 512 "
        "pixels, in a fresh process",
        "peak_memory_mesh_512_mib": "the same while a mesh is made on a grid of 512 points along the longest side",
        "memory_budget_mib": "asked for by --memory",
    }
