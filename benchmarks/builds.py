"""Seconds of networks of other builds, with seeded weights: what each option costs, and the sizes of the paper and of pixelNeRF."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import torch

from benchmarks.untrained import network_of, parameters_of
from charnerf.bench.rendering import measure
from charnerf.bench.subjects import Pictured, subject
from charnerf.bench.timing import in_turns
from charnerf.bench.workbench import ADAPTIVE, BASELINE, CULLED
from charnerf.inference.build import build_renderer
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.base import AbstractRenderer
from charnerf.volume.renderers.culled import CulledRenderer

BUILDS = {
    "default": (),
    "encoder=single": ("encoder=single",),
    "combinator=mean": ("combinator=mean",),
    "combinator=sa": ("combinator=sa",),
    "combinator=view_mha": ("combinator=view_mha",),
    "experiment=charnerf": ("experiment=charnerf",),
}
PIXELNERF = ("experiment=pixelnerf", "scale=paper")
WITHOUT_RESNET = (
    "encoder=single",
    "scale.feature_dim=512",
)  # as many channels, where no package brings the ResNet
NUM_RAYS = 64  # of the large networks
FEWER = 4  # times fewer samples on the hull's segments than over the box
LARGE_TOLERANCE = 0.05


def build_rows(pictured: Pictured, like: dict[str, Any], *, repeats: int) -> list[dict[str, Any]]:
    """Seconds to encode and to render some pixels by renderer=culled, of each build."""
    rows = []
    for name, overrides in BUILDS.items():
        network, _ = network_of(overrides)
        one = subject(pictured, network)
        renderer = CulledRenderer(**like)
        methods: dict[str, Callable[[], Any]] = {
            "encode": partial(network.encode, one.views),
            "render": partial(renderer.render, one.scene, one.rays),
        }
        with torch.no_grad():
            timings = in_turns(methods, repeats=repeats, device=one.truth.device)
        rows.append(
            {
                "build": name,
                "parameters": parameters_of(network),
                "encode_seconds": timings["encode"].median,
                "render_seconds": timings["render"].median,
            }
        )
    return rows


def large_network(pictured: Pictured, *, repeats: int) -> dict[str, Any]:
    """Seconds and errors of rendering by pixelNeRF's own network, seeded weights.

    Culled takes pixelNeRF's numbers of samples on the hull's segments of the rays, and a quarter of them: the
    segments are a quarter of the box's length or less, so that this is the baseline's own spacing.
    """
    has_resnet = find_spec("transformers") is not None
    network, cfg = network_of(PIXELNERF if has_resnet else PIXELNERF + WITHOUT_RESNET)
    like = build_renderer(cfg).settings
    fewer = {**like, **{name: like[name] // FEWER for name in ("num_coarse", "num_fine")}}
    one = subject(pictured, network, num_pixels=NUM_RAYS)
    renderers: dict[str, AbstractRenderer] = {
        f"{CULLED} {like['num_coarse']} + {like['num_fine']}": CulledRenderer(**like),
        f"{CULLED} {fewer['num_coarse']} + {fewer['num_fine']}": CulledRenderer(**fewer),
        f"{ADAPTIVE} {LARGE_TOLERANCE}": AdaptiveRenderer(**like, tolerance=LARGE_TOLERANCE),
    }
    measured = measure(one, renderers, repeats=repeats)
    base = measured[BASELINE].seconds
    return {
        "parameters": parameters_of(network),
        "encoder": "ResNet-34" if has_resnet else "hourglass",
        "rays": NUM_RAYS,
        "methods": {
            name: {
                "seconds": one.seconds,
                "rays/s": one.rays_per_second,
                "speed-up": base / one.seconds,
                "rms error": one.rms_error,
                "max error": one.max_error,
            }
            for name, one in measured.items()
        },
    }
