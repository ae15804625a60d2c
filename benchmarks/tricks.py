"""The single tricks, each switched off: what it is worth while all others stay on."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from torch import Tensor

from charnerf.bench.baseline import PixelNeRFLike
from charnerf.bench.subjects import Subject
from charnerf.bench.sweep import Method
from charnerf.bench.workbench import CULLED, Workbench
from charnerf.models.character import CharacterField
from charnerf.models.lookup import maps_to_rows
from charnerf.scene import FunctionField, Scene
from charnerf.types import FieldOutput
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer


def tricks(bench: Workbench) -> dict[tuple[str, str], Method]:
    """By (curve, name) what renders a subject with a trick off while the others stay on, as renderer=culled does."""
    culled = bench.renderers[CULLED]
    like = bench.like

    def on(subject: Subject) -> Callable[[], Any]:
        return partial(culled.render, subject.scene, subject.rays)

    def unpacked(subject: Subject) -> Callable[[], Any]:
        return partial(DenseRenderer(**like).render, subject.scene, subject.rays)

    def without_hull_segments(subject: Subject) -> Callable[[], Any]:
        """Samples over the whole box at the same spacing, packed by the hull all the same."""
        bounds = replace(subject.scene.bounds, hull=None, outlines=None)
        scene = replace(_scene_by(subject, _masked(subject.scene)), bounds=bounds)
        side = float((bounds.box_max - bounds.box_min).amax())
        count = max(like["num_coarse"], round(side / _spacing(subject, CulledRenderer(**like))))
        renderer = CulledRenderer(**{**like, "num_coarse": count})
        return partial(renderer.render, scene, subject.rays)

    def by_grid_sample(subject: Subject) -> Callable[[], Any]:
        baseline = PixelNeRFLike(subject.network)
        ask = partial(baseline.evaluate, subject.network.coarse, subject.maps)
        return partial(culled.render, _scene_by(subject, ask), subject.rays)

    def unhoisted(subject: Subject) -> Callable[[], Any]:
        return partial(culled.render, _scene_by(subject, _unhoisted(subject)), subject.rays)

    def huge_chunks(subject: Subject) -> Callable[[], Any]:
        renderer = CulledRenderer(**like)
        renderer.points_at_once = sys.maxsize
        field = FunctionField(subject.scene.coarse, bytes_per_point=1)
        return partial(renderer.render, replace(subject.scene, coarse=field), subject.rays)

    variants = {
        "all on": on,
        "packing off": unpacked,
        "hull segments off": without_hull_segments,
        "rows off (grid_sample, not hoisted)": by_grid_sample,
        "hoisting off": unhoisted,
        "chunks off (one batch)": huge_chunks,
    }
    return {("one trick off", name): method for name, method in variants.items()}


def _scene_by(subject: Subject, function: Callable[[Tensor, Tensor], FieldOutput]) -> Scene:
    """The subject's scene with a field of one pass by a function."""
    return Scene(FunctionField(function), None, subject.scene.bounds)


def _masked(scene: Scene) -> Callable[[Tensor, Tensor], FieldOutput]:
    """The field with the hull applied, evaluated only inside."""

    def field(points: Tensor, dirs: Tensor) -> FieldOutput:
        inside = scene.bounds.may_hold(points).nonzero()[:, 0]
        answer = scene.coarse(points[inside], dirs[inside])
        return FieldOutput(
            rgb=points.new_zeros(points.shape).index_copy(0, inside, answer.rgb),
            densities=points.new_zeros(len(points)).index_copy(0, inside, answer.densities),
        )

    return field


def _spacing(subject: Subject, culled: CulledRenderer) -> float:
    """Mean distance of samples on the occupied part of rays that meet the hull, m."""
    length = culled.occupied(subject.scene, subject.rays).length
    met = length[length > 0]
    return float(met.mean()) / culled.num_coarse if len(met) else 0.05


def _unhoisted(subject: Subject) -> Callable[[Tensor, Tensor], FieldOutput]:
    """The field with its linear layer applied to what is read at each point."""
    hoisted = subject.scene.coarse
    assert isinstance(hoisted, CharacterField)
    field, rows = hoisted.field, maps_to_rows(subject.maps.feature_maps)

    def answer(points: Tensor, dirs: Tensor) -> FieldOutput:
        inputs = hoisted.maps.read(points, rows)
        latents = field.from_latents(inputs.latents) * inputs.views.valid[..., None]
        output: FieldOutput = field(replace(inputs, latents=latents), dirs)
        return output

    return answer
