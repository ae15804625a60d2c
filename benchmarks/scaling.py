"""How seconds and memory grow with the size of the work: exponents fitted to doublings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from benchmarks.grids import CUBE_SIDE, grid_sampler
from charnerf.bench.subjects import Pictured, Subject
from charnerf.bench.sweep import FACTORS
from charnerf.bench.workbench import ADAPTIVE, BAKED, CULLED, TOLERANCE, Workbench
from charnerf.evaluation.timing import Stopwatch
from charnerf.geometry.resizing import resized_cameras
from charnerf.meshing.optical_depth import SURFACE
from charnerf.models.charnerf import CharNeRF
from charnerf.types import SourceViews
from charnerf.volume.renderers.baked import BakedRenderer
from charnerf.volume.renderers.culled import CulledRenderer

IMAGE_SIDES, GRID_SIDES, VIEWS, CHARACTERS, SAMPLES = (
    (64, 128, 256, 512),
    (64, 128, 256),
    (1, 2, 4, 8),
    (1, 2, 4),
    (8, 16, 32, 64),
)


@dataclass(frozen=True)
class Growth:
    """Seconds and rise of memory by size, with exponents p of size^p.

    Attributes:
        over: What grows.
        sizes: Its sizes.
        seconds: Of the work at each.
        memory_mib: Rise of resident memory at each (heaps keep what they once had: a lower bound).
        seconds_exponent: Least squares in logarithms, the smallest size left out: fixed costs rule there.
    """

    over: str
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]
    memory_mib: tuple[float, ...]
    seconds_exponent: float


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """P of value = c * size^p by least squares in logarithms.

    >>> round(exponent([1, 2, 4], [3, 12, 48]), 6)
    2.0
    """
    return float(np.polyfit(np.log(np.asarray(sizes)), np.log(np.maximum(values, 1e-9)), 1)[0])


def grow(over: str, work: Mapping[int, Callable[[], Any]], device: torch.device) -> Growth:
    """Run work of several sizes, twice each; the faster run counts.

    Args:
        over: What grows.
        work: By size, ascending.
        device: Where it runs.
    """
    seconds, memory = [], []
    with Stopwatch(device) as watch, torch.no_grad():
        for size, call in work.items():
            taken = []
            for turn in range(2):
                name = f"{size}:{turn}"
                with watch.stage(f"before {name}"):
                    pass
                with watch.stage(name):
                    call()
                taken.append(watch.total_seconds(name))
                peaks = watch.peaks_mib()
                rise = peaks.get(name, math.nan) - peaks.get(f"before {name}", math.nan)
                if turn == 0:
                    memory.append(rise)
            seconds.append(min(taken))
    sizes = tuple(work)
    fitted = exponent(sizes[1:], seconds[1:])
    return Growth(over, sizes, tuple(seconds), tuple(memory), fitted)


def growths(bench: Workbench, subject: Subject, pictured: Sequence[Pictured]) -> list[Growth]:
    """All the growths of the report.

    Args:
        bench: What is measured.
        subject: One character.
        pictured: Several, of one drawing size.
    """
    device, views = subject.truth.device, _more_views(subject)
    adaptive, baked = bench.renderers[ADAPTIVE], bench.renderers[BAKED]
    scene = baked.prepared(subject.scene)

    def picture(size: int) -> Callable[[], Any]:
        return lambda: adaptive.render_camera(subject.scene, resized_cameras(subject.camera, size, size))

    def baked_picture(size: int) -> Callable[[], Any]:
        return lambda: baked.render_camera(scene, resized_cameras(subject.camera, size, size))

    def baked_grid(factor: int) -> Callable[[], Any]:
        return lambda: BakedRenderer(**bench.like, tolerance=TOLERANCE, factor=factor).prepared(subject.scene)

    def grid(size: int) -> Callable[[], Any]:
        return lambda: grid_sampler(subject, size, 8).evaluate_surface(SURFACE)

    def seen_by(count: int) -> Callable[[], Any]:
        seen = _scene(bench.network, views[:, :count])
        return lambda: bench.renderers[CULLED].render(seen, subject.rays)

    def encode(count: int) -> Callable[[], Any]:
        batch = SourceViews.joined([pictured[i % len(pictured)].views for i in range(count)])
        return lambda: bench.network.encode(batch.to(device))

    def sampled(count: int) -> Callable[[], Any]:
        renderer = CulledRenderer(**{**bench.like, "num_coarse": count})
        return lambda: renderer.render(subject.scene, subject.rays)

    return [
        grow("image side, pixels (adaptive)", {n: picture(n) for n in IMAGE_SIDES}, device),
        grow("image side, pixels (baked)", {n: baked_picture(n) for n in IMAGE_SIDES}, device),
        grow("steps of the baked grid in a pixel", {n: baked_grid(n) for n in FACTORS}, device),
        grow(f"grid cells along {CUBE_SIDE} m (sparse)", {n: grid(n) for n in GRID_SIDES}, device),
        grow("source views (culled)", {n: seen_by(n) for n in VIEWS}, device),
        grow("characters (encode)", {n: encode(n) for n in CHARACTERS}, device),
        grow("samples a ray (culled)", {n: sampled(n) for n in SAMPLES}, device),
    ]


def _scene(network: CharNeRF, views: SourceViews) -> Any:
    with torch.no_grad():
        return network.scene(network.encode(views), 0)


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
