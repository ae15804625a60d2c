"""The parts of the benchmark, by name: each measures one thing and can be measured alone."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any

import torch

from benchmarks import processes, repeats
from benchmarks.builds import build_rows, large_network
from benchmarks.grids import grid_share
from benchmarks.hull_cut import cut_by_hull
from benchmarks.losses import compared_curves, loss_curves
from benchmarks.memory import Work, peak_memory
from benchmarks.meshes import mesh_rows
from benchmarks.plots import plot_growth, plot_kinds, plot_losses
from benchmarks.precision import compiled_methods, precision_methods
from benchmarks.roofline import roofline
from benchmarks.scaling import growths
from benchmarks.setting import Setting
from benchmarks.steps import step_at_scale
from benchmarks.threads import thread_rows
from benchmarks.tricks import tricks
from benchmarks.untrained import network_of, resized_network
from charnerf.bench.headline import compare, headline
from charnerf.bench.plots import plot_work_precision
from charnerf.bench.rendering import measure
from charnerf.bench.subjects import NUM_PIXELS, subject
from charnerf.bench.sweep import Method, sample_methods, sweep
from charnerf.bench.timing import in_turns
from charnerf.bench.turntable import turntable
from charnerf.bench.workbench import ADAPTIVE, BAKED, BASELINE, CULLED, DENSE, Workbench
from charnerf.geometry.resizing import resized_views
from charnerf.inference.build import build_renderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer

Part = Callable[[Setting], Any]
WIDE = 512
MEMORY_SIDES = (128, 256, 512)
SOURCE_SIDES = (32, 64, 96, 128, 192)
CURVE_RAYS, CURVE_STEPS, CURVE_SEEDS, CURVE_RATE = 128, 60, 3, 1e-3


def _headline(setting: Setting) -> dict[str, Any]:
    return headline(setting.bench, setting.characters)


def _kinds(setting: Setting) -> list[dict[str, Any]]:
    return [one.as_dict() for one in compare(setting.bench, setting.kinds, repeats=2)]


def _exactness(setting: Setting) -> list[dict[str, Any]]:
    """Largest difference of a color between culled and dense at the same samples."""
    rows = []
    for one in [*setting.characters, *setting.kinds]:
        with torch.no_grad():
            ours = setting.bench.renderers[CULLED].render(one.scene, one.rays).finest.rgb
            full = setting.bench.renderers[DENSE].render(one.scene, one.rays).finest.rgb
        rows.append({"subject": one.name, "culled - dense": float((ours - full).abs().amax())})
    return rows


def _samples(setting: Setting) -> list[dict[str, Any]]:
    rows = sweep(sample_methods(setting.bench), setting.characters, repeats=3)
    title = f"{NUM_PIXELS} pixels of each of {len(setting.characters)} characters"
    plot_work_precision(rows, setting.picture("samples"), title=title)
    return [vars(row) for row in rows]


def _kind_samples(setting: Setting) -> dict[str, Any]:
    """The sweep of samples on every kind of scene."""
    measured = {}
    for one in setting.kinds:
        setting.say(f"kind: {one.name}")
        measured[one.name] = sweep(sample_methods(setting.bench), [one], repeats=1)
    plot_kinds(measured, setting.picture("kind_samples"))
    return {kind: [vars(row) for row in rows] for kind, rows in measured.items()}


def _swept(
    methods: Callable[[Workbench], dict[tuple[str, str], Method]], name: str, setting: Setting
) -> list[dict[str, Any]]:
    """A sweep of other methods on one character."""
    rows = sweep(methods(setting.bench), setting.characters[:1], repeats=3)
    plot_work_precision(rows, setting.picture(name), title=f"{name}: {NUM_PIXELS} pixels of one character")
    return [vars(row) for row in rows]


def _resolutions(setting: Setting) -> list[dict[str, Any]]:
    """Error and seconds by the side of the drawings; the reference is that of the drawings as they are."""
    bench, original = setting.bench, setting.characters[0]
    rows = []
    for side in SOURCE_SIDES:
        pictured = replace(setting.pictured[0], views=resized_views(setting.pictured[0].views, side))
        network = copy(bench.network)  # that takes drawings of this side as they are
        network.image_size = side
        one = subject(pictured, network)
        encode = partial(network.encode, one.views)
        with torch.no_grad():
            timing = in_turns({"encode": encode}, repeats=2, device=one.truth.device)["encode"]
        adaptive = {ADAPTIVE: bench.renderers[ADAPTIVE]}
        measured = measure(one, adaptive, repeats=2, baseline=False, reference=original.converged)[ADAPTIVE]
        rows.append(
            {
                "side": side,
                "encode seconds": timing.median,
                "render seconds": measured.seconds,
                "psnr": measured.psnr,
                "rms error": measured.rms_error,
            }
        )
    return rows


def _turntables(setting: Setting) -> list[dict[str, Any]]:
    """A turntable of every character, beside the baseline's by its rays a second on random pixels."""
    rows = []
    for one in setting.characters:
        baseline = measure(one, {}, repeats=3, reference=torch.ones_like(one.truth))[BASELINE]
        taken = turntable(one, setting.bench.renderers[BAKED])
        rows.append({"subject": one.name, **taken.as_dict(baseline.rays_per_second)})
    return rows


def _arithmetic(setting: Setting) -> list[dict[str, Any]]:
    """Products of matrices against the machine's peak, at the model's width and at 512 with seeded weights."""
    rows = []
    networks = {"own width": setting.bench.network, f"width {WIDE}": resized_network(setting.model, WIDE)}
    for name, network in networks.items():
        one = subject(setting.pictured[0], network)
        for method in (CULLED, ADAPTIVE):
            measured = roofline(one, setting.bench.renderers[method])
            rows.append({"network": name, "renderer": method, **vars(measured)})
    return rows


def _losses(setting: Setting) -> list[dict[str, Any]]:
    """Losses of training one character from seeded weights: culled, dense and as the baseline."""
    network, cfg = network_of(("scale=small",))
    like = {**build_renderer(cfg).settings, "num_coarse": int(cfg.scale.train_num_coarse)}
    pictured = setting.pictured[0]
    one = subject(pictured, network, num_pixels=pictured.camera.width * pictured.camera.height)
    curves = loss_curves(
        one,
        {CULLED: CulledRenderer(**like), DENSE: DenseRenderer(**like)},
        num_rays=CURVE_RAYS,
        steps=CURVE_STEPS,
        seeds=CURVE_SEEDS,
        rate=CURVE_RATE,
    )
    plot_losses(curves, setting.picture("losses"))
    return compared_curves(curves)


def _memory(setting: Setting) -> list[dict[str, Any]]:
    """Rise of resident memory by image side and grid side, each in a fresh process."""
    bench, pictured = setting.bench, setting.pictured[0]
    rows = []
    works: dict[Work, str] = {"render": ADAPTIVE, "bake and render": BAKED, "mesh": ADAPTIVE}
    for work, renderer in works.items():
        for side in MEMORY_SIDES:
            peak = peak_memory(work, bench.network, bench.renderers[renderer], pictured, size=side)
            rows.append({"work": work, "side": side, **vars(peak)})
    return rows


def _scaling(setting: Setting) -> list[dict[str, Any]]:
    grown = [vars(growth) for growth in growths(setting.bench, setting.characters[0], setting.pictured)]
    plot_growth(grown, setting.picture("scaling"))
    return grown


PARTS: dict[str, Part] = {
    "headline": _headline,
    "samples": _samples,
    "kinds": _kinds,
    "kind_samples": _kind_samples,
    "tricks": partial(_swept, tricks, "tricks"),
    "precision": partial(_swept, precision_methods, "precision"),
    "compile": partial(_swept, compiled_methods, "compile"),
    "exactness": _exactness,
    "hull": lambda setting: cut_by_hull(setting.bench.network, setting.every),
    "turntable": _turntables,
    "size": lambda setting: large_network(setting.pictured[0], repeats=1),
    "arithmetic": _arithmetic,
    "steps": lambda setting: [
        step_at_scale(setting.pictured[0], "small", repeats=3),
        step_at_scale(setting.pictured[0], "base", repeats=1),
    ],
    "threads": lambda setting: thread_rows(setting.say),
    "processes": lambda setting: processes.process_rows(setting.say),
    "repeats": lambda setting: repeats.repeat_rows(
        setting.model.source, setting.pictured[0], rounds=repeats.ROUNDS
    ),
    "losses": _losses,
    "grids": lambda setting: [
        {"character": one.name, **vars(grid_share(one, cells=256, num_cameras=8))}
        for one in setting.characters
    ],
    "meshes": lambda setting: mesh_rows(setting.characters[0]),
    "memory": _memory,
    "scaling": _scaling,
    "resolution": _resolutions,
    "builds": lambda setting: build_rows(setting.pictured[0], setting.bench.like, repeats=3),
}
