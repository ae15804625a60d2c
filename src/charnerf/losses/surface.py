"""Colour and alpha of points on the captured surface."""

from collections.abc import Sequence
from typing import final

import torch
from torch import Tensor

from charnerf.errors import ConfigError
from charnerf.losses.base import AbstractTerm, Needs, Query
from charnerf.losses.directions import AbstractDirections
from charnerf.losses.terms import absolute_alpha_error, squared_color_error
from charnerf.types import FieldOutput, RenderOutput, TrainBatch
from charnerf.volume.compositing import alphas_from_densities


@final
class Surface(AbstractTerm):
    """A point on the surface has the surface's colour, and an interval there is opaque.

    Args:
        rgb_weight: Of the squared error of colours.
        alpha_weight: Of the absolute error of alphas.
        directions: Along which directions the points are seen.
        delta: Length of the interval, m; None: the paper's, the depth range over the samples of a ray.
        box_half_extent: Half of the depth range, m.
        num_coarse: Coarse samples of a training ray.
        num_fine: Fine ones.

    Raises:
        ConfigError: If the length is not positive.

    Source: paper, Mix of 2d ray sampling and 3d surface sampling ((z_far - z_near) / (n_coarse + n_fine), real depths); Final Loss
        function (weights 0.1).
    """

    def __init__(
        self,
        *,
        rgb_weight: float,
        alpha_weight: float,
        directions: AbstractDirections,
        delta: float | None,
        box_half_extent: float,
        num_coarse: int,
        num_fine: int,
    ) -> None:
        if delta is not None and not delta > 0.0:
            raise ConfigError(f"loss.surface.delta: found {delta}, expected more than 0 m, or null.")
        self.weights = {"surface_rgb": rgb_weight, "surface_alpha": alpha_weight}
        self.needs = Needs(surface=True)
        self.directions = directions
        self.delta = 2.0 * box_half_extent / (num_coarse + num_fine) if delta is None else delta

    def query(self, batch: TrainBatch, generators: Sequence[torch.Generator]) -> Query | None:
        """The batch's surface points; None where a character has no mesh."""
        if batch.surface is None:
            return None
        each = zip(batch.surface.points, batch.rays.origins, generators, strict=True)
        directions = [self.directions(points, origins, generator) for points, origins, generator in each]
        return Query(batch.surface.points, torch.stack(directions))

    def values(self, rays: RenderOutput, answer: FieldOutput | None, batch: TrainBatch) -> dict[str, Tensor]:
        """Both errors."""
        if answer is None or batch.surface is None:
            return {}
        alphas = alphas_from_densities(answer.densities, torch.full_like(answer.densities, self.delta))
        return {
            "surface_rgb": squared_color_error(answer.rgb, batch.surface.rgb),
            "surface_alpha": absolute_alpha_error(alphas, alphas.new_ones(())),
        }
