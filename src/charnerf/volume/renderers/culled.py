"""Evaluates only what lies inside the hull; exact."""

from typing import final

import torch
from torch import Tensor

from charnerf.types import FieldFunction, FieldOutput, LeftOut, RayBundle, Rendering, RenderOutput, Scene
from charnerf.volume.renderers.base import WHITE, AbstractRenderer


@final
class CulledRenderer(AbstractRenderer):
    """Leaves out rays that miss the hull and samples outside it: their density is zero by definition."""

    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,); those that miss are white without any work."""
        occupied = self.occupied(scene, rays)
        hit = (occupied.length > 0).nonzero()[:, 0]
        num_rays, missed = len(occupied.length), len(occupied.length) - len(hit)
        finest, coarse, left_out = self._two_passes(scene, occupied.take(hit), generator)
        a_ray = self.num_coarse + (0 if scene.fine is None else self.num_coarse + self.num_fine)
        far = occupied.t_edges[:, -1]
        return Rendering(
            finest=_spread(finest, hit, far),
            coarse=None if coarse is None else _spread(coarse, hit, far),
            left_out=left_out
            + LeftOut(rays=missed, rays_of=num_rays, samples=missed * a_ray, samples_of=missed * a_ray),
        )

    def _evaluate(
        self, field: FieldFunction, points: Tensor, dirs: Tensor, inside: Tensor, chunk: int
    ) -> tuple[FieldOutput, int]:
        """Pack the samples inside, evaluate them, and put them back among zeros."""
        packed = inside.reshape(-1).nonzero()[:, 0]
        answer = self._in_chunks(field, points.reshape(-1, 3)[packed], dirs.reshape(-1, 3)[packed], chunk)
        total = inside.numel()
        rgb = answer.rgb.new_zeros(total, 3).index_copy(0, packed, answer.rgb)
        densities = answer.densities.new_zeros(total).index_copy(0, packed, answer.densities)
        return FieldOutput(rgb=rgb.reshape(points.shape), densities=densities.reshape(inside.shape)), len(
            packed
        )


def _spread(output: RenderOutput, hit: Tensor, far: Tensor) -> RenderOutput:
    """Put rendered rays back among those that missed."""
    num_rays = len(far)
    return RenderOutput(
        rgb=output.rgb.new_full((num_rays, 3), WHITE).index_copy(0, hit, output.rgb),
        opacity=output.opacity.new_zeros(num_rays).index_copy(0, hit, output.opacity),
        depth=far.to(output.depth.dtype).index_copy(0, hit, output.depth),
    )
