"""Training steps at the scales of conf/scale: packed, dense, and as the baseline."""

from __future__ import annotations

from typing import Any

from benchmarks.untrained import network_of
from charnerf.bench.subjects import Pictured, subject
from charnerf.bench.training_step import batch_of, step_timings
from charnerf.bench.workbench import CULLED, DENSE
from charnerf.inference.build import build_renderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer


def step_at_scale(pictured: Pictured, scale: str, *, repeats: int) -> dict[str, Any]:
    """A training step at a scale, seeded weights, the rays of its first phase: packed, dense, and as the baseline."""
    network, cfg = network_of((f"scale={scale}",))
    num_rays = int(cfg.scale.phase_rays[0])
    renderer = build_renderer(cfg)
    like = {**renderer.settings, "num_coarse": int(cfg.scale.train_num_coarse)}
    one = subject(pictured, network, num_pixels=num_rays)
    renderers = {CULLED: CulledRenderer(**like), DENSE: DenseRenderer(**like)}
    timings = step_timings(one, batch_of(one, num_rays), renderers, repeats=repeats)
    fast = timings[CULLED].median
    return {
        "scale": scale,
        "rays": num_rays,
        "seconds": {name: timing.median for name, timing in timings.items()},
        "speedup_of_culled": {name: timing.median / fast for name, timing in timings.items()},
    }
