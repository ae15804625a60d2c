"""A turntable of one character, baking included, beside what the baseline would take; and pictures as a viewer asks for them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from statistics import median

import torch

from charnerf.bench.subjects import Subject
from charnerf.evaluation.timing import synchronize
from charnerf.geometry.resizing import resized_cameras
from charnerf.scene import Scene
from charnerf.types import Cameras
from charnerf.volume.baking.field import BakedField
from charnerf.volume.renderers.base import AbstractRenderer

FRAMES, SIDE = 36, 192  # as `charnerf reconstruct` makes
LOOKS, LOOK_SIDE = 6, 256  # pictures from around, each waited for


@dataclass(frozen=True)
class Turntable:
    """What a character's pictures took.

    Attributes:
        bake_seconds: Until the scene was ready to be looked at.
        bake_mib: What is held of it; 0 of one that is not baked.
        frames_seconds: Of 36 frames of 192 pixels.
        look_seconds: Median of one picture of 256 pixels.
    """

    bake_seconds: float
    bake_mib: float
    frames_seconds: float
    look_seconds: float

    @property
    def seconds(self) -> float:
        """Of the turntable, baking included."""
        return self.bake_seconds + self.frames_seconds

    def as_dict(self, rays_per_second: float) -> dict[str, float]:
        """Numbers for JSON, beside a baseline that renders so many rays a second."""
        theirs = FRAMES * SIDE**2 / rays_per_second
        return {
            "turntable_speedup": theirs / self.seconds,
            "frames_per_second_256": 1.0 / self.look_seconds,
            "bake_seconds": self.bake_seconds,
            "bake_mib": self.bake_mib,
            "turntable_seconds": self.seconds,
        }


@torch.no_grad()
def turntable(subject: Subject, renderer: AbstractRenderer) -> Turntable:
    """Take all pictures of a subject by a renderer."""
    device = subject.truth.device
    synchronize(device)
    start = time.perf_counter()
    scene = renderer.prepared(subject.scene)
    synchronize(device)
    bake_seconds = time.perf_counter() - start
    frames = _seconds_around(scene, renderer, resized_cameras(subject.camera, SIDE, SIDE), FRAMES)
    looks = _seconds_around(scene, renderer, resized_cameras(subject.camera, LOOK_SIDE, LOOK_SIDE), LOOKS)
    mib = scene.field.grid.mib if isinstance(scene.field, BakedField) else 0.0
    return Turntable(bake_seconds, mib, sum(frames), median(looks))


def _seconds_around(scene: Scene, renderer: AbstractRenderer, camera: Cameras, count: int) -> list[float]:
    """Of each of so many pictures from around."""
    taken = []
    for number in range(count):
        start = time.perf_counter()
        renderer.render_camera(scene, turned(camera, 2.0 * math.pi * number / count))
        synchronize(camera.focal.device)
        taken.append(time.perf_counter() - start)
    return taken


def turned(camera: Cameras, angle: float) -> Cameras:
    """The camera carried round the vertical axis by an angle, rad."""
    turn = torch.eye(4, dtype=camera.focal.dtype, device=camera.focal.device)
    turn[0, 0] = turn[1, 1] = math.cos(angle)
    turn[1, 0], turn[0, 1] = math.sin(angle), -math.sin(angle)
    return replace(camera, world_from_camera=turn @ camera.world_from_camera)
