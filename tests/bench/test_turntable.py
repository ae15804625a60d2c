"""Turntables of the benchmark: baking counts, and is told apart."""

import pytest
import torch

from charnerf.bench import turntable as module
from charnerf.bench.rendering import measure
from charnerf.volume.renderers.baked import BakedRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from support.subjects import LIKE, tiny_subject


def test_a_turntable_counts_baking_and_frames(monkeypatch):
    for name, value in {"FRAMES": 2, "SIDE": 12, "LOOKS": 1, "LOOK_SIDE": 12}.items():
        monkeypatch.setattr(module, name, value)
    one = tiny_subject()
    baked = module.turntable(one, BakedRenderer(**LIKE, tolerance=0.05))
    assert baked.bake_seconds > 0.0 and baked.bake_mib > 0.0
    assert baked.seconds == baked.bake_seconds + baked.frames_seconds
    numbers = baked.as_dict(rays_per_second=100.0)
    assert numbers["turntable_speedup"] == pytest.approx(2 * 12**2 / 100.0 / baked.seconds)
    assert module.turntable(one, CulledRenderer(**LIKE)).bake_mib == 0.0


def test_baked_colors_are_near_the_converged():
    one = tiny_subject()
    found = measure(one, {"baked": BakedRenderer(**LIKE, tolerance=0.05)}, repeats=1, baseline=False)["baked"]
    assert found.max_error <= 0.05 and found.estimate is not None
    assert torch.isfinite(found.estimate.estimated).all()
