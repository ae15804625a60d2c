"""All sweeps of the full benchmark, with their diagrams."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.bench.architectures import architecture_rows, large_network, step_at_scale
from charnerf.bench.headline import ADAPTIVE, NUM_PIXELS, Prepared, Workbench
from charnerf.bench.memory import peak_memory
from charnerf.bench.meshes import mesh_rows
from charnerf.bench.plots import plot_growth, plot_work_precision
from charnerf.bench.rendering import BASELINE, measure
from charnerf.bench.scaling import growths
from charnerf.bench.subjects import Pictured, Subject, subject
from charnerf.bench.sweeps import (
    compiled_methods,
    precision_methods,
    sample_methods,
    sweep,
    trick_methods,
)
from charnerf.types import Cameras, SourceViews

FRAMES = 36
MEMORY_SIDES = (128, 256, 512)
SOURCE_SIDES = (32, 64, 96, 128, 192)


def all_sweeps(
    bench: Workbench,
    pictured: Sequence[Pictured],
    prepared: Prepared,
    output: Path,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """Run every sweep; plots go to `output`.

    Args:
        bench: Networks and renderers.
        pictured: Characters.
        prepared: The same with references.
        output: Folder for plots.
        say: Told what is being done.
    """
    subjects, references = [list(some) for some in zip(*prepared.characters, strict=True)]
    result: dict[str, Any] = {}
    for name, methods in (
        ("samples", sample_methods(bench)),
        ("tricks", trick_methods(bench)),
        ("precision", precision_methods(bench)),
        ("compile", compiled_methods(bench)),
    ):
        say(f"sweep: {name}")
        some = subjects if name == "samples" else subjects[:1]
        rows = sweep(methods, some, references, repeats=3)
        plot_work_precision(rows, output / f"{name}.png", title=f"{name}: {NUM_PIXELS} pixels a character")
        result[f"sweep_{name}"] = [row.as_dict() for row in rows]
    result["sweep_kinds"] = _kinds(bench, prepared, output, say)
    say("source resolution")
    result["source_resolution"] = _resolutions(pictured[0], bench, references[0])
    say("builds")
    result["builds"] = architecture_rows(pictured[0], bench.like, num_pixels=NUM_PIXELS, repeats=3)
    say("pixelNeRF's size")
    result["large_network"] = large_network(pictured[0], repeats=1)
    say("training steps")
    result["training_steps"] = [
        step_at_scale(pictured[0], "small", repeats=3),
        step_at_scale(pictured[0], "base", repeats=1),
    ]
    say("meshes")
    result["meshes"] = mesh_rows(subjects[0])
    say("turntable")
    result["turntable"] = _turntable(subjects[0], bench)
    say("scaling")
    grown = growths(bench, subjects[0], pictured, _more_views(subjects[0]))
    result["scaling"] = [one.as_dict() for one in grown]
    plot_growth(result["scaling"], output / "scaling.png")
    say("memory by size")
    result["memory_growth"] = _memory_growth(bench, pictured[0])
    return result


def _kinds(bench: Workbench, prepared: Prepared, output: Path, say: Callable[[str], None]) -> dict[str, Any]:
    """The sweep of samples on every kind of scene, a diagram each."""
    found = {}
    for one, truth in prepared.kinds:
        say(f"kind: {one.kind}")
        rows = sweep(sample_methods(bench), [one], [truth], repeats=1)
        file = f"kind_{one.kind.replace(' ', '_')}.png"
        plot_work_precision(rows, output / file, title=one.kind)
        found[one.kind] = [row.as_dict() for row in rows]
    return found


def _resized_drawings(views: SourceViews, side: int) -> SourceViews:
    """Drawings of another resolution, their cameras with them."""
    factor = side / views.images.shape[-1]
    flat = views.images.flatten(0, 1)
    images = F.interpolate(flat, size=(side, side), mode="bilinear", align_corners=False, antialias=True)
    cameras = replace(
        views.cameras,
        focal=views.cameras.focal * factor,
        principal_point=views.cameras.principal_point * factor,
        width=side,
        height=side,
    )
    return replace(views, images=images.clamp(0.0, 1.0).unflatten(0, views.present.shape), cameras=cameras)


def _resolutions(pictured: Pictured, bench: Workbench, truth: Tensor) -> list[dict[str, Any]]:
    """Error and seconds by the side of the drawings; the reference is that of the drawings as they are."""
    rows = []
    for side in SOURCE_SIDES:
        views = _resized_drawings(pictured.views, side)
        one = subject(replace(pictured, views=views), bench.network, kind=str(side), num_pixels=NUM_PIXELS)
        start = time.perf_counter()
        with torch.no_grad():
            bench.network.encode(one.views)
        encoding = time.perf_counter() - start
        found = measure(one, {ADAPTIVE: bench.renderers[ADAPTIVE]}, truth, repeats=2, baseline=False)[
            ADAPTIVE
        ]
        rows.append(
            {
                "side": side,
                "encode_seconds": encoding,
                "render_seconds": found.seconds,
                "psnr": found.psnr,
                "rms_error": found.rms_error,
            }
        )
    return rows


def _turntable(one: Subject, bench: Workbench) -> dict[str, Any]:
    """36 frames with hull, encoding and all, against 36 frames of the baseline by its rays a second."""
    adaptive = bench.renderers[ADAPTIVE]
    start = time.perf_counter()
    with torch.no_grad():
        scene = one.network.scene(one.network.encode(one.views), 0)
        for frame in range(FRAMES):
            adaptive.render_camera(scene, turned(one.camera, 2.0 * math.pi * frame / FRAMES))
    ours = time.perf_counter() - start
    timed = measure(one, {}, torch.ones_like(one.truth, dtype=torch.float64), repeats=1)[BASELINE]
    theirs = FRAMES * one.camera.width * one.camera.height / timed.rays_per_second
    return {
        "frames": FRAMES,
        "side": one.camera.width,
        "seconds": ours,
        "baseline_seconds_by_its_rays_a_second": theirs,
        "speedup": theirs / ours,
    }


def turned(camera: Cameras, angle: float) -> Cameras:
    """The camera carried round the vertical axis by an angle, rad."""
    turn = torch.eye(4, dtype=camera.focal.dtype, device=camera.focal.device)
    turn[0, 0] = turn[1, 1] = math.cos(angle)
    turn[1, 0], turn[0, 1] = math.sin(angle), -math.sin(angle)
    return replace(camera, world_from_camera=turn @ camera.world_from_camera)


def _memory_growth(bench: Workbench, pictured: Pictured) -> list[dict[str, Any]]:
    """Rise of resident memory by image side and grid side, each in a fresh process."""
    rows = []
    for work in ("render", "mesh"):
        for side in MEMORY_SIDES:
            found = peak_memory(work, bench.network, bench.renderers[ADAPTIVE], pictured, size=side)
            rows.append({"work": work, "side": side, "rise MiB": found.rise_mib, "seconds": found.seconds})
    return rows


def _more_views(one: Subject) -> SourceViews:
    """Eight present views made of the drawings that there are, turned about: seconds do not depend on what they show."""
    views = one.views
    count = views.images.shape[1]
    index = torch.arange(8, device=views.images.device) % count
    return SourceViews(
        images=views.images[:, index],
        cameras=views.cameras[:, index],
        present=views.present[:, index],
        mirrored=views.mirrored[:, index],
    )
