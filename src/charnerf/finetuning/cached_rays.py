"""Samples of fixed rays, with all that frozen parts answer about them computed once.

Letters: R rays, S samples a ray, K samples inside the hull, V views, D width. Encoder, f1 and hull do not
change while what follows them learns, so neither do the samples' places, what the views show of them, nor
f1's features. A step then costs the combinator, f2 and the head alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.models.character import CharacterField
from charnerf.models.field import Field
from charnerf.models.inputs import PointViews
from charnerf.scene import Scene
from charnerf.types import RayBundle, TensorRecord
from charnerf.volume.compositing import composite
from charnerf.volume.marching import (
    RaySamples,
    coarse_samples,
    densities_inside,
    finer_samples,
    points_at_once,
)
from charnerf.volume.renderers.base import WHITE, AbstractRenderer

BYTES = 4  # of a float32


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
        samples: Their samples.
        rows: What frozen parts answer at the K samples inside.
        numbers: Row of each sample, (R, S); K where it lies outside.
    """

    samples: RaySamples
    rows: _Rows
    numbers: Tensor

    def __len__(self) -> int:
        return len(self.numbers)


@torch.no_grad()
def place(
    renderer: AbstractRenderer, scene: Scene, rays: RayBundle, generator: torch.Generator | None
) -> tuple[RaySamples, Tensor]:
    """Place samples on rays as a renderer does, the coarse field deciding where the fine one looks.

    Returns:
        The rays that meet the hull, and which of the given ones these are.
    """
    seen = renderer.occupied(scene, rays)
    hit = (seen.length > 0).nonzero()[:, 0]
    seen, bounds = seen[hit], scene.bounds
    samples = coarse_samples(bounds, seen, renderer.num_coarse, generator)
    if scene.fine is not None:
        samples = finer_samples(
            bounds,
            seen,
            samples,
            densities_inside(scene.coarse, samples.points, samples.view_dirs, samples.inside),
            quadrature=renderer.quadrature,
            num_samples=renderer.num_fine,
            generator=generator,
        )
    return samples, hit


def within_memory(samples: RaySamples, field: CharacterField, mib: float) -> int:
    """How many of the rays may be cached within a bound, MiB, at the mean number of samples a ray."""
    row = len(field.maps.mirrored) * (field.field.multi_view.density.in_features + 8) * BYTES
    num_samples = int(samples.inside.sum()) / max(1, len(samples.inside))
    return max(1, int(mib * 2**20 / (row * max(num_samples, 1.0))))


@torch.no_grad()
def cache(field: CharacterField, samples: RaySamples) -> CachedRays:
    """Compute once what frozen parts answer at the samples inside the hull."""
    points, dirs = samples.points[samples.inside], samples.view_dirs[samples.inside]
    size = points_at_once(field)
    parts = []
    for start in range(0, len(points), size):
        inputs, view_dirs = field.read(points[start : start + size]), dirs[start : start + size]
        features = field.field.view_features(inputs, view_dirs)
        parts.append(_Rows(features, inputs.views, view_dirs, inputs.kept))
    numbers = torch.full_like(samples.inside, len(points), dtype=torch.long)
    numbers[samples.inside] = torch.arange(len(points), device=points.device)
    return CachedRays(samples, _Rows.joined(parts), numbers)


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
    samples = cached.samples[index]
    weights, _ = renderer.quadrature.weights(densities.reshape(inside.shape), samples.s_vals, samples.s_edges)
    picture = composite(weights, rgb.reshape(*inside.shape, 3), weights.new_tensor(WHITE))
    return picture, weights.sum(-1)
