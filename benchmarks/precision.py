"""The field in other precisions and compiled, by renderer=culled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import torch

from charnerf.bench.subjects import Subject
from charnerf.bench.sweep import Method, rendered_by
from charnerf.bench.workbench import CULLED, Workbench
from charnerf.scene import FunctionField
from charnerf.types import Rendering


def precision_methods(bench: Workbench) -> dict[tuple[str, str], Method]:
    """Precisions of the field."""
    culled = bench.renderers[CULLED]
    methods: dict[tuple[str, str], Method] = {("precision", "float32"): partial(rendered_by, culled)}
    methods["precision", "float64"] = partial(_in_float64, culled)
    methods["precision", "bfloat16 (autocast)"] = partial(_autocast, culled)
    return methods


def compiled_methods(bench: Workbench) -> dict[tuple[str, str], Method]:
    """The field as it is and compiled; compiling is warm-up and not counted."""
    culled = bench.renderers[CULLED]
    return {
        ("compile", "eager"): partial(rendered_by, culled),
        ("compile", "torch.compile"): partial(_compiled, culled),
    }


def _in_float64(renderer: Any, subject: Subject) -> Callable[[], Any]:
    scene, rays = subject.in_float64(), subject.rays.to(torch.float64)
    return partial(renderer.render, scene, rays)


def _autocast(renderer: Any, subject: Subject) -> Callable[[], Any]:
    def render() -> Rendering:
        with torch.autocast(subject.truth.device.type, torch.bfloat16):
            return renderer.render(subject.scene, subject.rays)

    return render


def _compiled(renderer: Any, subject: Subject) -> Callable[[], Any]:
    field = FunctionField(torch.compile(subject.scene.coarse.__call__, dynamic=True))
    scene = replace(subject.scene, coarse=field)
    return partial(renderer.render, scene, subject.rays)
