"""How sharp a field's surface is, and where it stands: entropy of ray weights, and depth against the captured mesh.

The paper says of its surface loss that it concentrates the weights of a ray and gives no figures; these are they. Every row is
sampled alike, whatever its own renderer does: NUM_SAMPLES even samples on the part of a ray inside the hull, constant density
in each bin, the finest field. Letters: R rays, S samples a ray, Q shares of the rays, D bins of distance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.errors import DataError
from charnerf.evaluation.frames import fixed_views
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.models.charnerf import CharNeRF
from charnerf.scene import Scene
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.surfaces.raycast import RayCaster
from charnerf.types import RayBundle, TensorRecord
from charnerf.volume.compositing import expected_depth, weights_from_densities
from charnerf.volume.marching import coarse_samples, densities_inside
from charnerf.volume.renderers.base import AbstractRenderer

RAY_WEIGHTS_FILE = "ray_weights.json"
NUM_SAMPLES = 64  # a ray
VIEWS = 4  # a character
SIZE = 64  # rays across a picture, at most
OPAQUE = 0.5
SHARES = [place / 20 for place in range(20)]  # of the rays; the worst twentieth would set the scale
REACH, STEP = 0.3, 0.02  # m, of the distances from the true surface


@dataclass(frozen=True)
class RayWeights:
    """Means over the rays of a character at which both mesh and field are opaque, then over characters.

    Attributes:
        characters: Names.
        num_rays: Rays of all characters that count.
        opaque_share: Share of the mesh's rays at which the field is opaque too.
        entropy: Of a ray's weights, in [0, 1]: see `normalised_entropy`.
        depth_error_m: Mean of |expected depth - true depth|, m.
        depth_offset_m: Mean of expected depth - true depth, m: negative in front of the surface.
        hull_depth_error_m: The same error of the hull's first occupied point, None for a model without a hull.
        shares: Shares of the rays, (Q).
        entropy_at: Entropy that this share of the rays stays below, (Q).
        error_at: Depth error that this share of the rays stays below, (Q), m.
        distances_m: Middles of bins of distance behind the true surface, (D), m.
        weight_at: Mean share of a ray's weight in each, (D).
    """

    characters: list[str]
    num_rays: int
    opaque_share: float
    entropy: float
    depth_error_m: float
    depth_offset_m: float
    hull_depth_error_m: float | None
    shares: list[float]
    entropy_at: list[float]
    error_at: list[float]
    distances_m: list[float]
    weight_at: list[float]


@dataclass(frozen=True)
class _OpaqueRays(TensorRecord):
    """Of rays (R,): entropy, expected depth, true depth and the hull's depth, m (NaN without a hull); histogram (R, D)."""

    entropy: Tensor
    depth: Tensor
    truth: Tensor
    hull: Tensor
    histogram: Tensor


def normalised_entropy(weights: Tensor) -> Tensor:
    """Entropy of weights (..., S) as a share of the largest: -sum_i p_i log(p_i) / log(S) with p_i = w_i / sum_j w_j.

    0 where one sample holds all the weight, 1 where all hold the same; 1 too where there is no weight.

    Args:
        weights: Non-negative, S of at least 2.

    Returns:
        (...), in [0, 1].
    """
    total = weights.sum(-1, keepdim=True)
    even = torch.full_like(weights, 1.0 / weights.shape[-1])
    normalised = torch.where(total > 0, weights / total.clamp_min(torch.finfo(weights.dtype).tiny), even)
    entropy = torch.special.entr(normalised).sum(-1)
    return (entropy / np.log(weights.shape[-1])).clamp(0.0, 1.0)


@torch.no_grad()
def ray_weights(
    network: CharNeRF,
    renderer: AbstractRenderer,
    characters: Sequence[Character],
    *,
    views: int = VIEWS,
    size: int = SIZE,
    num_samples: int = NUM_SAMPLES,
) -> RayWeights:
    """Measure a trained model on characters whose meshes are known.

    Args:
        network: In eval mode.
        renderer: Its renderer, for the part of a ray inside the hull.
        characters: Of a test split; those without a mesh are passed over.
        views: Cameras a character, the first of its fixed test views.
        size: Rays across a picture, at most: every n-th pixel.
        num_samples: S.

    Raises:
        DataError: If no character has a mesh, or the model shows nothing of them.
    """
    with_mesh = [one for one in characters if one.mesh_file is not None]
    if not with_mesh:
        raise DataError(
            "the data set has no meshes of these characters, expected some: true depth needs them."
        )
    opaque, num_rays = {}, 0
    for one in with_mesh:
        rays, count = _character(network, renderer, one, views, size, num_samples)
        num_rays += count
        if len(rays.depth):
            opaque[one.name] = rays
    if not opaque:
        names = ", ".join(one.name for one in with_mesh)
        raise DataError(
            f"the model shows nothing of {names}, expected opaque rays; was it trained long enough?"
        )
    return _summary(opaque, num_rays)


def _summary(opaque: Mapping[str, _OpaqueRays], num_rays: int) -> RayWeights:
    """Means over characters, quantiles over all rays; `num_rays` meet the meshes, opaque or not."""
    each = list(opaque.values())
    errors = [(one.depth - one.truth).abs() for one in each]
    hulls = [(one.hull - one.truth).abs().nanmean() for one in each if not bool(one.hull.isnan().all())]

    def mean(values: Sequence[Tensor]) -> float:
        return float(torch.stack([one.double().mean() for one in values]).mean())

    def at(values: Sequence[Tensor]) -> list[float]:
        joined = torch.cat(list(values)).double().numpy()
        return [float(value) for value in np.quantile(joined, SHARES)]

    count = sum(len(one.depth) for one in each)
    return RayWeights(
        characters=list(opaque),
        num_rays=count,
        opaque_share=count / max(num_rays, 1),
        entropy=mean([one.entropy for one in each]),
        depth_error_m=mean(errors),
        depth_offset_m=mean([one.depth - one.truth for one in each]),
        hull_depth_error_m=mean(hulls) if hulls else None,
        shares=list(SHARES),
        entropy_at=at([one.entropy for one in each]),
        error_at=at(errors),
        distances_m=[round(float(value), 6) for value in 0.5 * (_edges()[1:] + _edges()[:-1])],
        weight_at=torch.stack([one.histogram.double().mean(0) for one in each]).mean(0).tolist(),
    )


def _edges() -> Tensor:
    return torch.linspace(-REACH, REACH, round(2 * REACH / STEP) + 1, dtype=torch.float64)


def _character(
    network: CharNeRF,
    renderer: AbstractRenderer,
    character: Character,
    views: int,
    size: int,
    num_samples: int,
) -> tuple[_OpaqueRays, int]:
    """Rays of a character's cameras at which mesh and field are opaque, on the CPU; how many meet the mesh."""
    assert character.mesh_file is not None
    caster = RayCaster.of_surface(load_surface_mesh(character.mesh_file))
    scene = network.scene(network.encode(character.sources.to(network.device)), 0)
    opaque, num_rays = [], 0
    for index in fixed_views(character, views):
        camera = character.cameras[index]
        step = -(-max(camera.width, camera.height) // size)
        pixels = pixel_centres(camera.width, camera.height).to(camera.focal.dtype)[::step, ::step]
        rays = pixel_rays(camera, pixels.reshape(-1, 2))
        truth = torch.from_numpy(caster.first_hits(rays.origins.numpy(), rays.directions.numpy()).distances)
        hit = truth.isfinite().nonzero()[:, 0]
        num_rays += len(hit)
        seen, distances = rays[hit].to(network.device), truth[hit].to(network.device)
        opaque.append(_measured(scene, renderer, seen, distances, num_samples))
    return _OpaqueRays.joined(opaque).to("cpu"), num_rays


def _measured(
    scene: Scene, renderer: AbstractRenderer, rays: RayBundle, truth: Tensor, num_samples: int
) -> _OpaqueRays:
    """Weights along rays (R,) that meet the mesh at truth (R,), m; those that the field lets through are left out."""
    seen = renderer.occupied(scene, rays)
    inside = (seen.length > 0).nonzero()[:, 0]
    seen, truth = seen[inside], truth[inside]
    samples = coarse_samples(scene.bounds, seen, num_samples)
    densities = densities_inside(scene.field, samples.points, samples.view_dirs, samples.inside)
    weights, _ = weights_from_densities(densities, samples.s_edges.diff(dim=-1))
    opaque = weights.sum(-1) > OPAQUE
    weights, t_vals, truth = weights[opaque], samples.t_vals[opaque], truth[opaque]
    first = seen.occupied.to(torch.int8).argmax(-1, keepdim=True)
    entry = seen.t_edges.gather(-1, first)[:, 0][opaque]
    return _OpaqueRays(
        entropy=normalised_entropy(weights),
        depth=expected_depth(weights, t_vals, seen.far[opaque]),
        truth=truth,
        hull=entry if scene.bounds.hull is not None else torch.full_like(entry, torch.nan),
        histogram=_histogram(weights, t_vals - truth[:, None]),
    )


def _histogram(weights: Tensor, behind: Tensor) -> Tensor:
    """Share of each ray's weight (R, S) in bins of distance behind the true surface, (R, D)."""
    edges = _edges().to(behind)
    place = torch.bucketize(behind, edges) - 1
    within = (place >= 0) & (place < len(edges) - 1)
    normalised = weights / weights.sum(-1, keepdim=True)
    empty = weights.new_zeros(len(weights), len(edges) - 1)
    return empty.scatter_add(-1, place.clamp(0, len(edges) - 2), torch.where(within, normalised, 0.0))
