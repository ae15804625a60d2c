"""From rays to colours: samples on the occupied part of each ray, quadrature, a fine pass where there is a fine field."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

from charnerf.geometry.cameras import pixel_centres, pixel_rays
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
from charnerf.volume.marching import (
    POINTS_AT_ONCE,
    OccupiedRays,
    RaySamples,
    coarse_samples,
    finer_samples,
    points_at_once,
    points_in_memory,
)
from charnerf.volume.quadrature.base import AbstractQuadrature

WHITE = 1.0


Evaluate = Callable[[AbstractField, RaySamples], tuple[FieldOutput, int]]
"""Answers a field at samples (R, S), zero density where they are not inside; and how many were evaluated."""


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

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments that every renderer takes, of this one."""
        return {
            "quadrature": self.quadrature,
            "num_coarse": self.num_coarse,
            "num_fine": self.num_fine,
            "hull_steps": self.hull_steps,
            "memory_mib": self.memory_mib,
        }

    @abstractmethod
    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,).

        Args:
            scene: What is looked at.
            rays: Rays (R,).
            generator: Jitters the samples (training); without it the result is deterministic.
        """

    def prepared(self, scene: Scene, on_share: Callable[[float], object] = lambda share: None) -> Scene:
        """The scene as it is best looked at many times: with what this renderer computes once for all of its pictures.

        Args:
            scene: One character.
            on_share: Called again and again with the share of that work that is done, in [0, 1]; what it raises ends it.
        """
        return scene

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

    def occupied(self, scene: Scene, rays: RayBundle) -> OccupiedRays:
        """Where rays (R,) may meet something."""
        return OccupiedRays.of(scene.bounds, rays, self.hull_steps)

    def _two_passes(
        self, scene: Scene, seen: OccupiedRays, generator: torch.Generator | None, evaluate: Evaluate
    ) -> tuple[RenderOutput, RenderOutput | None, LeftOut]:
        """Coarse pass, then the fine one where there is a fine field; both for all the rays given."""
        samples = coarse_samples(scene.bounds, seen, self.num_coarse, generator)
        answer, evaluated = evaluate(scene.coarse, samples)
        coarse, left_out = self._composed(answer, samples, seen.far), _left_out(samples, evaluated)
        if scene.fine is None:
            return coarse, None, left_out
        samples = finer_samples(
            scene.bounds,
            seen,
            samples,
            answer.densities,
            quadrature=self.quadrature,
            num_samples=self.num_fine,
            generator=generator,
        )
        answer, evaluated = evaluate(scene.fine, samples)
        return self._composed(answer, samples, seen.far), coarse, left_out + _left_out(samples, evaluated)

    def _composed(self, answer: FieldOutput, samples: RaySamples, far: Tensor) -> RenderOutput:
        """Composite answers at samples (R, S) of rays that end at far (R,), m."""
        weights, _ = self.quadrature.weights(answer.densities, samples.s_vals, samples.s_edges)
        return RenderOutput(
            rgb=composite(weights, answer.rgb, weights.new_tensor(WHITE)),
            opacity=weights.sum(-1),
            depth=expected_depth(weights, samples.t_vals, far),
        )

    def _chunk(self, field: AbstractField) -> int:
        """Points to evaluate at once, at most."""
        chunk = points_in_memory(field, self.memory_mib)
        if torch.is_grad_enabled():  # each chunk would give the maps a dense gradient of its own
            return chunk
        return min(chunk, points_at_once(field, self.points_at_once))


def _left_out(samples: RaySamples, evaluated: int) -> LeftOut:
    total = samples.inside.numel()
    return LeftOut(samples=total - evaluated, samples_of=total)


def _joined(estimates: list[ErrorEstimate], shape: tuple[int, int]) -> ErrorEstimate | None:
    """One estimate of the parts of a picture."""
    if not estimates:
        return None
    return ErrorEstimate(
        tolerance=estimates[0].tolerance,
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
