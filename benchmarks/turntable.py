"""A turntable of whole frames, beside what the baseline would take."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import torch

from charnerf.bench.rendering import measure
from charnerf.bench.subjects import Subject
from charnerf.bench.workbench import BASELINE
from charnerf.types import Cameras
from charnerf.volume.renderers.base import AbstractRenderer

FRAMES = 36


def turntable(subject: Subject, renderer: AbstractRenderer) -> dict[str, Any]:
    """Seconds of 36 frames with hull, encoding and all, against 36 frames of the baseline by its rays a second."""
    start = time.perf_counter()
    with torch.no_grad():
        scene = subject.network.scene(subject.network.encode(subject.views), 0)
        for frame in range(FRAMES):
            renderer.render_camera(scene, turned(subject.camera, 2.0 * math.pi * frame / FRAMES))
    ours = time.perf_counter() - start
    timed = measure(subject, {}, repeats=3, reference=torch.ones_like(subject.truth))[BASELINE]
    theirs = FRAMES * subject.camera.width * subject.camera.height / timed.rays_per_second
    return {
        "frames": FRAMES,
        "side": subject.camera.width,
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
