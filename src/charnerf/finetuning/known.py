"""Samples of fixed rays, with all that frozen parts answer about them computed once.

Letters: R rays, S samples a ray, K samples inside the hull, V views, D width. Encoder, f1 and hull do not
change while what follows them learns, so neither do the samples' places, what the views show of them, nor
f1's features. A step then costs the combinator, f2 and the head alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from charnerf.geometry.rays import occupied_to_t, points_along
from charnerf.geometry.sampling import edges_from_t_vals, merge_t_vals, stratified_t_vals
from charnerf.models.charnerf import CharNeRF, EncodedViews
from charnerf.models.field import Field
from charnerf.models.inputs import PointInputs
from charnerf.models.lookup import maps_to_rows
from charnerf.scene import Scene
from charnerf.types import FieldOutput, RayBundle, TensorRecord
from charnerf.volume.compositing import composite
from charnerf.volume.renderers.base import POINTS_AT_ONCE, WHITE, AbstractRenderer

BYTES = 4  # of a float32


@dataclass(frozen=True)
class PlacedRays(TensorRecord):
    """Rays (R,) that meet the hull, with their samples.

    Attributes:
        directions: (R, 3).
        points: (R, S, 3), m.
        s_vals: Occupied arc length of the samples, (R, S), m.
        s_edges: Their bins, (R, S + 1), m.
        inside: Which samples lie inside the hull, (R, S).
    """

    directions: Tensor
    points: Tensor
    s_vals: Tensor
    s_edges: Tensor
    inside: Tensor


@dataclass(frozen=True)
class _Rows(TensorRecord):
    """What is known of samples (K,): f1's features (K, V, D), and inputs without what only f1 reads."""

    view_features: Tensor
    inputs: PointInputs


@dataclass(frozen=True)
class KnownRays:
    """Rays whose frozen part is known.

    Attributes:
        placed: Their samples.
        rows: What is known of the K samples inside.
        numbers: Row of each sample, (R, S); K where it lies outside.
    """

    placed: PlacedRays
    rows: _Rows
    numbers: Tensor

    def __len__(self) -> int:
        return len(self.numbers)


@torch.no_grad()
def place(
    renderer: AbstractRenderer, scene: Scene, rays: RayBundle, generator: torch.Generator | None
) -> tuple[PlacedRays, Tensor]:
    """Place samples on rays as a renderer does, the coarse field deciding where the fine one looks.

    Returns:
        The rays that meet the hull, and which of the given ones these are.
    """
    occupied = renderer.occupied(scene, rays)
    hit = (occupied.length > 0).nonzero()[:, 0]
    seen = occupied.take(hit)
    zero = torch.zeros_like(seen.length)
    s_vals = stratified_t_vals(zero, seen.length, renderer.num_coarse, generator)
    shares = torch.linspace(0.0, 1.0, renderer.num_coarse + 1, dtype=s_vals.dtype, device=s_vals.device)
    s_edges = seen.length[:, None] * shares
    points, inside = _look(scene, seen.rays, occupied_to_t(seen.t_edges, seen.occupied, s_vals))
    if scene.fine is not None:
        densities = torch.zeros_like(s_vals)
        dirs = seen.rays.directions[:, None].expand_as(points)
        densities[inside] = _in_chunks(
            lambda p, d: scene.coarse(p, d).densities, points[inside], dirs[inside]
        )
        drawn = renderer.quadrature.importance_t_vals(
            densities, s_vals, s_edges, renderer.num_fine, generator
        )
        s_vals = merge_t_vals(s_vals, drawn)
        s_edges = edges_from_t_vals(s_vals, zero, seen.length)
        points, inside = _look(scene, seen.rays, occupied_to_t(seen.t_edges, seen.occupied, s_vals))
    return PlacedRays(seen.rays.directions, points, s_vals, s_edges, inside), hit


def _look(scene: Scene, rays: RayBundle, t_vals: Tensor) -> tuple[Tensor, Tensor]:
    """Points (R, S, 3) along rays, and which a density may be at (R, S)."""
    points = points_along(rays, t_vals)
    return points, scene.bounds.may_hold(points)


def _in_chunks(function: Callable[[Tensor, Tensor], Tensor], points: Tensor, dirs: Tensor) -> Tensor:
    size = POINTS_AT_ONCE
    parts = [function(points[i : i + size], dirs[i : i + size]) for i in range(0, len(points), size)]
    return torch.cat(parts) if parts else points[:, 0]


def within_memory(placed: PlacedRays, network: CharNeRF, num_views: int, mib: float) -> int:
    """How many of the rays may be kept within a bound, MiB, at the mean number of samples a ray."""
    row = num_views * (finest(network).multi_view.density.in_features + 8) * BYTES
    samples = int(placed.inside.sum()) / max(1, len(placed.inside))
    return max(1, int(mib * 2**20 / (row * max(samples, 1.0))))


def finest(network: CharNeRF) -> Field:
    """The field that pictures and meshes are made of."""
    return network.coarse if network.fine is None else network.fine


@torch.no_grad()
def know(network: CharNeRF, encoded: EncodedViews, placed: PlacedRays) -> KnownRays:
    """Compute once what frozen parts answer at the samples inside the hull."""
    field = finest(network)
    inputs_of = _inputs_of(network, encoded, field)
    points, size = placed.points[placed.inside], POINTS_AT_ONCE
    dirs = placed.directions[:, None].expand_as(placed.points)[placed.inside]
    parts = []
    for start in range(0, len(points), size):
        inputs = inputs_of(points[start : start + size], dirs[start : start + size])
        features = field.view_features(inputs)
        unread = {"latents": inputs.latents[..., :0], "point_features": inputs.point_features[..., :0]}
        slim = replace(inputs, **unread, encoded_points=inputs.encoded_points[..., :0])
        parts.append(_Rows(features, slim))
    numbers = torch.full_like(placed.inside, len(points), dtype=torch.long)
    numbers[placed.inside] = torch.arange(len(points), device=points.device)
    return KnownRays(placed, _Rows.joined(parts), numbers)


def _inputs_of(
    network: CharNeRF, encoded: EncodedViews, field: Field
) -> Callable[[Tensor, Tensor], PointInputs]:
    """The field's inputs at points of the one character that was encoded."""
    views = encoded.views[0]
    present = views.present.nonzero()[:, 0]
    views, maps = views[present], encoded.feature_maps[0][present]
    hull = None if encoded.hull is None else encoded.hull[0]
    view_maps = network.view_maps(views, hull, present, maps)
    latents, mirrored = field.hoist(maps_to_rows(maps)), views.mirrored.to(maps.dtype)
    return lambda points, dirs: network.point_inputs(
        points, dirs, maps=view_maps, latents=latents, mirrored=mirrored
    )


def render_known(
    field: Field, renderer: AbstractRenderer, known: KnownRays, index: Tensor
) -> tuple[Tensor, Tensor]:
    """Colours on white (r, 3) and opacities (r,) of some of the rays, by what follows f1 in a field."""
    numbers = known.numbers[index]
    inside = numbers < len(known.rows.view_features)
    rows = known.rows[numbers[inside]]
    answer = answer_known(field, rows)
    at = inside.reshape(-1).nonzero()[:, 0]
    rgb = answer.rgb.new_zeros(inside.numel(), 3).index_copy(0, at, answer.rgb)
    densities = answer.densities.new_zeros(inside.numel()).index_copy(0, at, answer.densities)
    placed = known.placed[index]
    weights, _ = renderer.quadrature.weights(densities.reshape(inside.shape), placed.s_vals, placed.s_edges)
    picture = composite(weights, rgb.reshape(*inside.shape, 3), weights.new_tensor(WHITE))
    return picture, weights.sum(-1)


def answer_known(field: Field, rows: _Rows) -> FieldOutput:
    """What a field answers at samples whose f1 is known."""
    trunk = field.fuse(rows.view_features, rows.inputs)
    return FieldOutput(
        rgb=field.colors(trunk, rows.inputs), densities=field.kept_densities(trunk, rows.inputs)
    )
