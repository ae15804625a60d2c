"""Evaluates only what lies inside the hull and can be seen; exact."""

from typing import final

import torch
from torch import Tensor

from charnerf.scene import AbstractField, Scene
from charnerf.types import FieldOutput, LeftOut, RayBundle, Rendering, RenderOutput
from charnerf.volume.marching import RaySamples, in_chunks
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
        seen = self.occupied(scene, rays)
        hit = (seen.length > 0).nonzero()[:, 0]
        num_rays, missed = len(seen.length), len(seen.length) - len(hit)
        finest, coarse, left_out = self._two_passes(scene, seen[hit], generator, self.evaluate)
        a_ray = self.num_coarse + (0 if scene.fine is None else self.num_coarse + self.num_fine)
        return Rendering(
            finest=_spread(finest, hit, seen.far),
            coarse=None if coarse is None else _spread(coarse, hit, seen.far),
            left_out=left_out
            + LeftOut(rays=missed, rays_of=num_rays, samples=missed * a_ray, samples_of=missed * a_ray),
        )

    def evaluate(self, field: AbstractField, samples: RaySamples) -> tuple[FieldOutput, int]:
        """Pack the samples that count, evaluate them, and put them back among zeros, stage by stage."""
        inside, chunk = samples.inside, self._chunk(field)
        points, dirs = samples.points.reshape(-1, 3), samples.view_dirs.reshape(-1, 3)
        num_samples, evaluated = inside.shape[1], 0
        # a stage of less than a chunk costs its calls more than it spares
        chunks = 1 if torch.is_grad_enabled() else int(inside.sum()) // chunk
        stage = -(-num_samples // max(1, min(MOST_STAGES, chunks)))
        order = torch.arange(num_samples, device=inside.device)
        rgb, densities = torch.zeros_like(points), points.new_zeros(len(points))
        for start in range(0, num_samples, stage):
            counted = inside & (order >= start) & (order < start + stage)
            if (
                start > 0
            ):  # a density can only take light away: samples that are not there yet may stand as zeros
                so_far = densities.view(inside.shape)
                _, passed = self.quadrature.weights(so_far, samples.s_vals, samples.s_edges)
                counted &= (passed > UNSEEN)[:, None]
            packed = counted.reshape(-1).nonzero()[:, 0]
            answer = in_chunks(field, points.index_select(0, packed), dirs.index_select(0, packed), chunk)
            rgb = rgb.index_copy(0, packed, answer.rgb.to(rgb.dtype))
            densities = densities.index_copy(0, packed, answer.densities.to(densities.dtype))
            evaluated += len(packed)
        return FieldOutput(rgb.view(samples.points.shape), densities.view(inside.shape)), evaluated


def _spread(output: RenderOutput, hit: Tensor, far: Tensor) -> RenderOutput:
    """Put rendered rays back among those that missed."""
    num_rays = len(far)
    return RenderOutput(
        rgb=output.rgb.new_full((num_rays, 3), WHITE).index_copy(0, hit, output.rgb),
        opacity=output.opacity.new_zeros(num_rays).index_copy(0, hit, output.opacity),
        depth=far.to(output.depth.dtype).index_copy(0, hit, output.depth),
    )
