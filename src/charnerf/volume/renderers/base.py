"""From rays to colours: samples on the occupied part of each ray, quadrature, a fine pass where there is a fine field.

Samples are placed in the arc length `s` along the occupied steps of a ray, which runs from 0 to the
occupied length: outside the
hull the density is zero by definition, so that the integral over s is the integral over the ray. Without a
hull the whole
interval in the box counts.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.geometry.hull import occupied_edges
from charnerf.geometry.rays import box_interval, occupied_to_t, points_along
from charnerf.geometry.sampling import edges_from_t_vals, merge_t_vals, stratified_t_vals
from charnerf.scene import AbstractField, Scene
from charnerf.types import (
    Cameras,
    ErrorEstimate,
    FieldOutput,
    LeftOut,
    RayBundle,
    Rendering,
    RenderOutput,
)
from charnerf.volume.compositing import composite, expected_depth
from charnerf.volume.quadrature.base import AbstractQuadrature

WHITE = 1.0


@dataclass(frozen=True)
class OccupiedRays:
    """Rays with the steps that count: t_edges (R, N + 1), m, occupied (R, N), their total length (R,), m."""

    rays: RayBundle
    t_edges: Tensor
    occupied: Tensor
    length: Tensor

    def take(self, index: Tensor) -> "OccupiedRays":
        """Some of the rays."""
        return OccupiedRays(self.rays[index], self.t_edges[index], self.occupied[index], self.length[index])


class AbstractRenderer(ABC):
    """Volume rendering of scenes.

    Args:
        quadrature: From densities to weights.
        num_coarse: Samples a ray of the coarse pass.
        num_fine: Further samples of the fine pass; read only where the scene has a fine field.
        hull_steps: Steps in which a ray looks the hull up.
        memory_mib: Bound on what one chunk of points may take, MiB; the result does not depend on it.
    """

    def __init__(
        self,
        *,
        quadrature: AbstractQuadrature,
        num_coarse: int,
        num_fine: int,
        hull_steps: int,
        memory_mib: float,
    ) -> None:
        self.quadrature = quadrature
        self.num_coarse = num_coarse
        self.num_fine = num_fine
        self.hull_steps = hull_steps
        self.memory_mib = memory_mib
        self.points_at_once = POINTS_AT_ONCE

    @abstractmethod
    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,).

        Args:
            scene: What is looked at.
            rays: Rays (R,).
            generator: Jitters the samples (training); without it the result is deterministic.
        """

    def render_camera(self, scene: Scene, camera: Cameras) -> Rendering:
        """Render the picture of one camera, without gradient; fields come as (H, W, ...)."""
        pixels = pixel_centres(camera.width, camera.height, device=camera.focal.device).to(camera.focal.dtype)
        rays = pixel_rays(camera, pixels.reshape(-1, 2))
        rays_a_chunk = 65_536
        parts = []
        with torch.no_grad():
            for start in range(0, pixels.shape[0] * pixels.shape[1], rays_a_chunk):
                parts.append(self.render(scene, rays[start : start + rays_a_chunk]))
        left_out = sum((part.left_out for part in parts), LeftOut())
        coarse = [part.coarse for part in parts if part.coarse is not None]
        shape = (camera.height, camera.width)
        return Rendering(
            finest=_as_picture([part.finest for part in parts], shape),
            coarse=_as_picture(coarse, shape) if coarse else None,
            left_out=left_out,
            estimate=_joined([part.estimate for part in parts if part.estimate is not None], shape),
        )

    def _two_passes(
        self, scene: Scene, seen: OccupiedRays, generator: torch.Generator | None
    ) -> tuple[RenderOutput, RenderOutput | None, LeftOut]:
        """Coarse pass, then the fine one where there is a fine field; both for all the rays given."""
        s_vals = stratified_t_vals(torch.zeros_like(seen.length), seen.length, self.num_coarse, generator)
        coarse, densities, left_out = self._one_pass(scene, scene.coarse, seen, s_vals)
        if scene.fine is None:
            return coarse, None, left_out
        s_edges = self._edges(seen, s_vals)
        drawn = self.quadrature.importance_t_vals(
            densities.detach(), s_vals, s_edges, self.num_fine, generator
        )
        fine, _, more = self._one_pass(scene, scene.fine, seen, merge_t_vals(s_vals, drawn))
        return fine, coarse, left_out + more

    def _one_pass(
        self, scene: Scene, field: AbstractField, seen: OccupiedRays, s_vals: Tensor
    ) -> tuple[RenderOutput, Tensor, LeftOut]:
        """Evaluate a field at samples and composite: output (R,), densities (R, S), counts."""
        t_vals = occupied_to_t(seen.t_edges, seen.occupied, s_vals)
        points = points_along(seen.rays, t_vals)
        dirs = seen.rays.directions[:, None].expand_as(points)
        inside = (seen.length > 0)[:, None] & scene.bounds.may_hold(points)
        chunk = chunk_size(self.memory_mib, field.bytes_per_point)
        if not torch.is_grad_enabled():  # each chunk would give the maps a dense gradient of its own
            chunk = min(chunk, self.points_at_once, points_in_caches(field.bytes_per_point))
        s_edges = self._edges(seen, s_vals)
        answer, evaluated = self._evaluate(
            field,
            points,
            dirs,
            inside,
            chunk,
            lambda found: self.quadrature.weights(found, s_vals, s_edges)[1],
        )
        weights, _ = self.quadrature.weights(answer.densities, s_vals, s_edges)
        far = seen.t_edges[:, -1]
        output = RenderOutput(
            rgb=composite(weights, answer.rgb, weights.new_tensor(WHITE)),
            opacity=weights.sum(-1),
            depth=expected_depth(weights, t_vals, far),
        )
        total = t_vals.numel()
        return output, answer.densities, LeftOut(samples=total - evaluated, samples_of=total)

    @abstractmethod
    def _evaluate(
        self,
        field: AbstractField,
        points: Tensor,
        dirs: Tensor,
        inside: Tensor,
        chunk: int,
        passed: Callable[[Tensor], Tensor],
    ) -> tuple[FieldOutput, int]:
        """Answers at samples (R, S, 3), zero density where not inside (R, S); and how many were evaluated.

        Args:
            field: What answers.
            points: Samples, (R, S, 3), m, front to back.
            dirs: Along which they are looked at, (R, S, 3).
            inside: Which may have a density, (R, S) bool.
            chunk: Points to evaluate at once, at most.
            passed: From densities (R, S) to the share of light that passes all samples, (R,); it falls with any density, so that
                samples which are not known yet may stand as zeros.
        """

    def _edges(self, seen: OccupiedRays, s_vals: Tensor) -> Tensor:
        """Bins of samples in occupied length, (R, S + 1)."""
        if s_vals.shape[-1] == self.num_coarse:  # stratified: equal bins
            share = torch.linspace(0.0, 1.0, self.num_coarse + 1, dtype=s_vals.dtype, device=s_vals.device)
            return seen.length[:, None] * share
        return edges_from_t_vals(s_vals, torch.zeros_like(seen.length), seen.length)

    def occupied(self, scene: Scene, rays: RayBundle) -> OccupiedRays:
        """Where rays (R,) may meet something."""
        bounds = scene.bounds
        if bounds.hull is None:
            near, far = box_interval(rays, *bounds.tight_box)
            return OccupiedRays(rays, torch.stack((near, far), dim=-1), (far > near)[:, None], far - near)
        t_edges, occupied = occupied_edges(bounds.hull, rays, self.hull_steps, bounds.coarse_hull)
        return OccupiedRays(rays, t_edges, occupied, (torch.diff(t_edges, dim=-1) * occupied).sum(-1))

    def _in_chunks(self, field: AbstractField, points: Tensor, dirs: Tensor, size: int) -> FieldOutput:
        """Answers at points (P, 3), a chunk of that size at a time."""
        parts = [field(points[i : i + size], dirs[i : i + size]) for i in range(0, len(points), size)]
        if not parts:
            return FieldOutput(rgb=torch.zeros_like(points), densities=torch.zeros_like(points[:, 0]))
        if len(parts) == 1:
            return parts[0]
        return FieldOutput(
            rgb=torch.cat([p.rgb for p in parts]), densities=torch.cat([p.densities for p in parts])
        )


POINTS_AT_ONCE = (
    4096  # more leave the caches: 8192 cost as much a point, 16384 nearly twice (two cores of a server)
)
# of a field: layers of 6 MiB; with 16 MiB width 512 took a fifth longer (one core)
BYTES_AT_ONCE = 96 * 2**20


def points_in_caches(bytes_per_point: int) -> int:
    """Points a chunk without gradient of a wide field: above, the system hands out the memory of each tensor anew."""
    return max(256, BYTES_AT_ONCE // bytes_per_point)


def chunk_size(memory_mib: float, bytes_per_point: int = 16_384) -> int:
    """Points a chunk within a memory budget, at least 256."""
    return max(256, int(memory_mib * 2**20 / bytes_per_point))


def _joined(estimates: list[ErrorEstimate], shape: tuple[int, int]) -> ErrorEstimate | None:
    """One estimate of the parts of a picture."""
    if not estimates:
        return None
    return ErrorEstimate(
        asked=estimates[0].asked,
        estimated=torch.cat([one.estimated for one in estimates]).reshape(shape),
        num_samples=sum(one.num_samples for one in estimates),
        num_colors=sum(one.num_colors for one in estimates),
        num_stopped=sum(one.num_stopped for one in estimates),
        num_unresolved=sum(one.num_unresolved for one in estimates),
    )


def _as_picture(outputs: list[RenderOutput], shape: tuple[int, int]) -> RenderOutput:
    """Concatenate outputs of rays and give them the picture's shape."""
    return RenderOutput(
        rgb=torch.cat([o.rgb for o in outputs]).reshape(*shape, 3),
        opacity=torch.cat([o.opacity for o in outputs]).reshape(shape),
        depth=torch.cat([o.depth for o in outputs]).reshape(shape),
    )
