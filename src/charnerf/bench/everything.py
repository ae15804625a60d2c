"""The parts of the full benchmark, with their diagrams: each measures one thing and can be measured alone."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import torch

from charnerf.bench.architectures import architecture_rows, large_network, network_of, step_at_scale
from charnerf.bench.headline import ADAPTIVE, CULLED, DENSE, NUM_PIXELS, Workbench, quick
from charnerf.bench.hull_cut import cut_by_hull
from charnerf.bench.memory import peak_memory
from charnerf.bench.meshes import mesh_rows
from charnerf.bench.plots import plot_growth, plot_kinds, plot_losses, plot_work_precision
from charnerf.bench.rendering import BASELINE, measure
from charnerf.bench.scaling import growths
from charnerf.bench.setting import Setting
from charnerf.bench.subjects import Subject, subject
from charnerf.bench.sweeps import (
    Method,
    compiled_methods,
    precision_methods,
    sample_methods,
    sweep,
    trick_methods,
)
from charnerf.bench.training_step import compared_curves, loss_curves
from charnerf.bench.workbench import settings_of
from charnerf.geometry.resizing import resized_views
from charnerf.inference import weights as runs
from charnerf.types import Cameras, SourceViews
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer

Part = Callable[[Setting], Any]
FRAMES = 36
MEMORY_SIDES = (128, 256, 512)
SOURCE_SIDES = (32, 64, 96, 128, 192)
CURVE_RAYS, CURVE_STEPS, CURVE_SEEDS, CURVE_RATE = 128, 60, 3, 1e-3


def _headline(setting: Setting) -> dict[str, Any]:
    return quick(setting.bench, setting.pictured, setting.characters, setting.kinds, setting.say)


def _exactness(setting: Setting) -> list[dict[str, Any]]:
    """Largest difference of a colour between culled and dense at the same samples."""
    rows = []
    for one, _ in [*setting.characters, *setting.kinds]:
        with torch.no_grad():
            ours = setting.bench.renderers[CULLED].render(one.scene, one.rays).finest.rgb
            full = setting.bench.renderers[DENSE].render(one.scene, one.rays).finest.rgb
        name = one.kind if one.kind != "character" else one.name
        rows.append({"subject": name, "culled - dense": float((ours - full).abs().amax())})
    return rows


def _samples(setting: Setting) -> list[dict[str, Any]]:
    subjects, references = setting.split_characters()
    rows = sweep(sample_methods(setting.bench), subjects, references, repeats=3)
    plot_work_precision(
        rows, setting.picture("samples"), title=f"{NUM_PIXELS} pixels of each of {len(subjects)} characters"
    )
    return [row.as_dict() for row in rows]


def _swept(methods: Callable[[Workbench], dict[tuple[str, str], Method]], name: str) -> Part:
    def part(setting: Setting) -> list[dict[str, Any]]:
        subjects, references = setting.split_characters()
        rows = sweep(methods(setting.bench), subjects[:1], references[:1], repeats=3)
        plot_work_precision(
            rows, setting.picture(name), title=f"{name}: {NUM_PIXELS} pixels of one character"
        )
        return [row.as_dict() for row in rows]

    return part


def _kinds(setting: Setting) -> dict[str, Any]:
    """The sweep of samples on every kind of scene."""
    found = {}
    for one, truth in setting.kinds:
        setting.say(f"kind: {one.kind}")
        found[one.kind] = sweep(sample_methods(setting.bench), [one], [truth], repeats=1)
    plot_kinds(found, setting.picture("kinds"))
    return {kind: [row.as_dict() for row in rows] for kind, rows in found.items()}


def _resolutions(setting: Setting) -> list[dict[str, Any]]:
    """Error and seconds by the side of the drawings; the reference is that of the drawings as they are."""
    bench, pictured = setting.bench, setting.pictured[0]
    rows = []
    for side in SOURCE_SIDES:
        views = resized_views(pictured.views, side)
        one = subject(replace(pictured, views=views), bench.network, kind=str(side), num_pixels=NUM_PIXELS)
        start = time.perf_counter()
        with torch.no_grad():
            bench.network.encode(one.views)
        encoding = time.perf_counter() - start
        truth = setting.characters[0][1]
        found = measure(one, {ADAPTIVE: bench.renderers[ADAPTIVE]}, truth, repeats=2, baseline=False)
        rows.append(
            {
                "side": side,
                "encode seconds": encoding,
                "render seconds": found[ADAPTIVE].seconds,
                "psnr": found[ADAPTIVE].psnr,
                "rms error": found[ADAPTIVE].rms_error,
            }
        )
    return rows


def _builds(setting: Setting) -> list[dict[str, Any]]:
    return architecture_rows(setting.pictured[0], setting.bench.like, num_pixels=NUM_PIXELS, repeats=3)


def _large(setting: Setting) -> dict[str, Any]:
    return large_network(setting.pictured[0], repeats=1)


def _steps(setting: Setting) -> list[dict[str, Any]]:
    return [
        step_at_scale(setting.pictured[0], "small", repeats=3),
        step_at_scale(setting.pictured[0], "base", repeats=1),
    ]


def _losses(setting: Setting) -> list[dict[str, Any]]:
    """Losses of training one character from seeded weights: culled, dense and as the baseline."""
    network, cfg = network_of(("scale=small",))
    renderer = runs.build_renderer(cfg)
    like = {**settings_of(renderer), "num_coarse": int(cfg.scale.train_num_coarse)}
    pictured = setting.pictured[0]
    pixels = pictured.camera.width * pictured.camera.height
    one = subject(pictured, network, kind="training", num_pixels=pixels)
    curves = loss_curves(
        one,
        {CULLED: CulledRenderer(**like), DENSE: DenseRenderer(**like)},
        num_rays=CURVE_RAYS,
        steps=CURVE_STEPS,
        seeds=CURVE_SEEDS,
        rate=CURVE_RATE,
        baseline=BASELINE,
    )
    plot_losses(curves, setting.picture("losses"))
    return compared_curves(curves, baseline=BASELINE)


def _meshes(setting: Setting) -> list[dict[str, Any]]:
    return mesh_rows(setting.characters[0][0])


def _turntable(setting: Setting) -> dict[str, Any]:
    """36 frames with hull, encoding and all, against 36 frames of the baseline by its rays a second."""
    one, adaptive = setting.characters[0][0], setting.bench.renderers[ADAPTIVE]
    start = time.perf_counter()
    with torch.no_grad():
        scene = one.network.scene(one.network.encode(one.views), 0)
        for frame in range(FRAMES):
            adaptive.render_camera(scene, turned(one.camera, 2.0 * math.pi * frame / FRAMES))
    ours = time.perf_counter() - start
    timed = measure(one, {}, torch.ones_like(one.truth, dtype=torch.float64), repeats=3)[BASELINE]
    theirs = FRAMES * one.camera.width * one.camera.height / timed.rays_per_second
    return {
        "frames": FRAMES,
        "side": one.camera.width,
        "seconds": ours,
        "baseline's seconds (extrapolated)": theirs,
        "speed-up": theirs / ours,
    }


def turned(camera: Cameras, angle: float) -> Cameras:
    """The camera carried round the vertical axis by an angle, rad."""
    turn = torch.eye(4, dtype=camera.focal.dtype, device=camera.focal.device)
    turn[0, 0] = turn[1, 1] = math.cos(angle)
    turn[1, 0], turn[0, 1] = math.sin(angle), -math.sin(angle)
    return replace(camera, world_from_camera=turn @ camera.world_from_camera)


def _scaling(setting: Setting) -> list[dict[str, Any]]:
    one = setting.characters[0][0]
    grown = [g.as_dict() for g in growths(setting.bench, one, setting.pictured, _more_views(one))]
    plot_growth(grown, setting.picture("scaling"))
    return grown


def _memory(setting: Setting) -> list[dict[str, Any]]:
    """Rise of resident memory by image side and grid side, each in a fresh process."""
    bench, pictured = setting.bench, setting.pictured[0]
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


def _hull(setting: Setting) -> list[dict[str, Any]]:
    return cut_by_hull(setting.bench.network, setting.every)


PARTS: dict[str, Part] = {
    "headline": _headline,
    "samples": _samples,
    "kinds": _kinds,
    "tricks": _swept(trick_methods, "tricks"),
    "precision": _swept(precision_methods, "precision"),
    "compile": _swept(compiled_methods, "compile"),
    "exactness": _exactness,
    "hull": _hull,
    "turntable": _turntable,
    "size": _large,
    "steps": _steps,
    "losses": _losses,
    "meshes": _meshes,
    "memory": _memory,
    "scaling": _scaling,
    "resolution": _resolutions,
    "builds": _builds,
}
QUICK: Sequence[str] = ("headline",)
