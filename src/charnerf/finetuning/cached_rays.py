"""Samples of fixed rays, with all that frozen parts answer about them computed once.

Letters: R rays, S samples a ray, K samples inside the hull, V views, D width. Encoder, f1 and hull do not
change while what follows them learns, so neither do the samples' places, what the views show of them, nor
f1's features. A step then costs the combinator, f2 and the head alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.geometry.rays import occupied_to_t, points_along
from charnerf.geometry.sampling import edges_from_t_vals, merge_t_vals, stratified_t_vals
from charnerf.models.character import CharacterField
from charnerf.models.field import Field
from charnerf.models.inputs import PointViews
from charnerf.scene import Scene
from charnerf.types import RayBundle, TensorRecord
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
    """What frozen parts answer at samples (K,): f1's features (K, V, D), and what the parts behind f1 read beside them."""

    view_features: Tensor
    views: PointViews
    view_dirs: Tensor
    kept: Tensor


@dataclass(frozen=True)
class CachedRays:
    """Rays whose frozen part is computed.

    Attributes:
        placed: Their samples.
        rows: What frozen parts answer at the K samples inside.
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


def within_memory(placed: PlacedRays, field: CharacterField, mib: float) -> int:
    """How many of the rays may be cached within a bound, MiB, at the mean number of samples a ray."""
    row = len(field.maps.mirrored) * (field.field.multi_view.density.in_features + 8) * BYTES
    samples = int(placed.inside.sum()) / max(1, len(placed.inside))
    return max(1, int(mib * 2**20 / (row * max(samples, 1.0))))


@torch.no_grad()
def cache(field: CharacterField, placed: PlacedRays) -> CachedRays:
    """Compute once what frozen parts answer at the samples inside the hull."""
    points, size = placed.points[placed.inside], POINTS_AT_ONCE
    dirs = placed.directions[:, None].expand_as(placed.points)[placed.inside]
    parts = []
    for start in range(0, len(points), size):
        inputs, view_dirs = field.read(points[start : start + size]), dirs[start : start + size]
        features = field.field.view_features(inputs, view_dirs)
        parts.append(_Rows(features, inputs.views, view_dirs, inputs.kept))
    numbers = torch.full_like(placed.inside, len(points), dtype=torch.long)
    numbers[placed.inside] = torch.arange(len(points), device=points.device)
    return CachedRays(placed, _Rows.joined(parts), numbers)


def render_cached(
    field: Field, renderer: AbstractRenderer, cached: CachedRays, index: Tensor
) -> tuple[Tensor, Tensor]:
    """Colours on white (r, 3) and opacities (r,) of some of the rays, by what follows f1 in a field."""
    numbers = cached.numbers[index]
    inside = numbers < len(cached.rows.view_features)
    rows = cached.rows[numbers[inside]]
    trunk = field.fuse(rows.view_features, rows.views, rows.view_dirs)
    colors, filled = field.colors(trunk, rows.views, rows.view_dirs), field.densities(trunk, rows.kept)
    at = inside.reshape(-1).nonzero()[:, 0]
    rgb = colors.new_zeros(inside.numel(), 3).index_copy(0, at, colors)
    densities = filled.new_zeros(inside.numel()).index_copy(0, at, filled)
    placed = cached.placed[index]
    weights, _ = renderer.quadrature.weights(densities.reshape(inside.shape), placed.s_vals, placed.s_edges)
    picture = composite(weights, rgb.reshape(*inside.shape, 3), weights.new_tensor(WHITE))
    return picture, weights.sum(-1)
