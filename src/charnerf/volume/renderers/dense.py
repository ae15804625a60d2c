"""Evaluates every sample of every ray and applies the hull afterwards: the reference."""

from collections.abc import Callable
from typing import final

import torch
from torch import Tensor

from charnerf.scene import AbstractField, Scene
from charnerf.types import FieldOutput, LeftOut, RayBundle, Rendering
from charnerf.volume.renderers.base import AbstractRenderer


@final
class DenseRenderer(AbstractRenderer):
    """Leaves nothing out; equal to the culled renderer to rounding."""

    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,), all of them."""
        finest, coarse, left_out = self._two_passes(scene, self.occupied(scene, rays), generator)
        return Rendering(
            finest=finest, coarse=coarse, left_out=left_out + LeftOut(rays=0, rays_of=rays.origins.shape[0])
        )

    def _evaluate(
        self,
        field: AbstractField,
        points: Tensor,
        dirs: Tensor,
        inside: Tensor,
        chunk: int,
        passed: Callable[[Tensor], Tensor],
    ) -> tuple[FieldOutput, int]:
        """Evaluate all samples, then set the density outside to zero."""
        answer = self._in_chunks(field, points.reshape(-1, 3), dirs.reshape(-1, 3), chunk)
        densities = answer.densities.reshape(inside.shape) * inside
        return FieldOutput(rgb=answer.rgb.reshape(points.shape), densities=densities), inside.numel()
