"""Peak memory of a large picture and a large mesh, each in a fresh process: what ran before hides nothing."""

from __future__ import annotations

import multiprocessing
from dataclasses import dataclass
from typing import Literal

import torch

from charnerf.bench.subjects import Pictured
from charnerf.errors import DependencyError
from charnerf.evaluation.timing import Stopwatch, process_peak_mib
from charnerf.geometry.cameras import pixel_centres
from charnerf.geometry.resizing import resized_cameras
from charnerf.meshing.build import build_mesh
from charnerf.meshing.options import MeshOptions
from charnerf.models.charnerf import CharNeRF
from charnerf.volume.renderers.base import AbstractRenderer

Work = Literal["render", "bake and render", "mesh"]


@dataclass(frozen=True)
class PeakMemory:
    """Rise of resident memory over the loaded, encoded model, MiB, and the seconds that the work took."""

    rise_mib: float
    seconds: float


def peak_memory(
    work: Work, network: CharNeRF, renderer: AbstractRenderer, pictured: Pictured, *, size: int
) -> PeakMemory:
    """Render a picture of size x size pixels, baking first where the renderer does, or make a mesh of a grid of size points a side.

    In a process of its own. On a CUDA device: in this one, by the allocator's own peak.
    """
    device = network.box[0].device
    task = (work, network, renderer, pictured, size, torch.get_num_threads())
    if device.type == "cuda":
        return _measure(*task)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_measure, task)


def _measure(
    work: Work,
    network: CharNeRF,
    renderer: AbstractRenderer,
    pictured: Pictured,
    size: int,
    threads: int,
) -> PeakMemory:
    torch.set_num_threads(threads)
    device = network.box[0].device
    views = pictured.views.to(device)
    with torch.no_grad():
        scene = network.scene(network.encode(views), 0)
        camera = resized_cameras(pictured.camera.to(device), size, size)
        # what is allocated once is no part of it
        renderer.render_camera(scene, resized_cameras(camera, 16, 16))
    with Stopwatch(device) as watch:
        with watch.stage("before"):
            pixel_centres(4, 4)
        before = watch.peaks_mib().get("before", process_peak_mib())
        with watch.stage("work"), torch.no_grad():
            if work == "mesh":
                build_mesh(scene, views, MeshOptions(resolution=size, height=None))
            else:
                renderer.render_camera(renderer.prepared(scene), camera)
        peak = watch.peaks_mib().get("work", process_peak_mib())
    if before is None or peak is None:
        raise DependencyError(
            "memory: this system does not tell how much a process holds, expected Linux or macOS."
        )
    return PeakMemory(rise_mib=peak - before, seconds=watch.total_seconds("work"))
