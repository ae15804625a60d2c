"""Evaluates only what lies inside the hull and can be seen; exact."""

from collections.abc import Callable
from typing import final

import torch
from torch import Tensor

from charnerf.scene import AbstractField, Scene
from charnerf.types import FieldOutput, LeftOut, RayBundle, Rendering, RenderOutput
from charnerf.volume.renderers.base import WHITE, AbstractRenderer

UNSEEN = 1e-6  # of the light: a sample that less of it reaches is not seen; a colour in float32 is rounded to a tenth of that
MOST_STAGES = 4  # in which a ray is evaluated, front to back; more would leave out little more


@final
class CulledRenderer(AbstractRenderer):
    """Leaves out rays that miss the hull, samples outside it, and samples behind opaque surface where nothing is learnt.

    The density outside is zero by definition and no light comes from behind, so that pictures are the dense renderer's to rounding.
    A gradient may change what is opaque: where one is kept, every sample inside is asked.
    """

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
        self,
        field: AbstractField,
        points: Tensor,
        dirs: Tensor,
        inside: Tensor,
        chunk: int,
        passed: Callable[[Tensor], Tensor],
    ) -> tuple[FieldOutput, int]:
        """Pack the samples that count, evaluate them, and put them back among zeros, stage by stage."""
        num_samples, evaluated = inside.shape[1], 0
        # a stage of less than a chunk costs its calls more than it spares
        chunks = 1 if torch.is_grad_enabled() else int(inside.sum()) // min(chunk, self.points_at_once)
        stage = -(-num_samples // max(1, min(MOST_STAGES, chunks)))
        order = torch.arange(num_samples, device=inside.device)
        rgb, densities = torch.zeros_like(points).reshape(-1, 3), points.new_zeros(inside.numel())
        for start in range(0, num_samples, stage):
            asked = inside & (order >= start) & (order < start + stage)
            if start > 0:
                asked &= (passed(densities.view(inside.shape)) > UNSEEN)[:, None]
            packed = asked.reshape(-1).nonzero()[:, 0]
            answer = self._in_chunks(field, points.reshape(-1, 3)[packed], dirs.reshape(-1, 3)[packed], chunk)
            rgb = rgb.index_copy(0, packed, answer.rgb.to(rgb.dtype))
            densities = densities.index_copy(0, packed, answer.densities.to(densities.dtype))
            evaluated += len(packed)
        return FieldOutput(rgb=rgb.view(points.shape), densities=densities.view(inside.shape)), evaluated


def _spread(output: RenderOutput, hit: Tensor, far: Tensor) -> RenderOutput:
    """Put rendered rays back among those that missed."""
    num_rays = len(far)
    return RenderOutput(
        rgb=output.rgb.new_full((num_rays, 3), WHITE).index_copy(0, hit, output.rgb),
        opacity=output.opacity.new_zeros(num_rays).index_copy(0, hit, output.opacity),
        depth=far.to(output.depth.dtype).index_copy(0, hit, output.depth),
    )
