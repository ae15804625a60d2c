"""Evaluates every sample of every ray and applies the hull afterwards: the reference."""

from typing import final

import torch

from charnerf.scene import AbstractField, Scene
from charnerf.types import FieldOutput, LeftOut, RayBundle, Rendering
from charnerf.volume.marching import RaySamples, in_chunks
from charnerf.volume.renderers.base import AbstractRenderer


@final
class DenseRenderer(AbstractRenderer):
    """Leaves nothing out; equal to the culled renderer to rounding."""

    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,), all of them."""
        seen = self.occupied(scene, rays)
        finest, coarse, left_out = self._two_passes(scene, seen, generator, self._evaluate)
        return Rendering(
            finest=finest, coarse=coarse, left_out=left_out + LeftOut(rays=0, rays_of=rays.origins.shape[0])
        )

    def _evaluate(self, field: AbstractField, samples: RaySamples) -> tuple[FieldOutput, int]:
        """Evaluate all samples, then set the density outside to zero."""
        points, dirs = samples.points.reshape(-1, 3), samples.view_dirs.reshape(-1, 3)
        answer = in_chunks(field, points, dirs, self._chunk(field))
        densities = answer.densities.reshape(samples.inside.shape) * samples.inside
        return FieldOutput(answer.rgb.reshape(samples.points.shape), densities), samples.inside.numel()
