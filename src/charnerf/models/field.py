"""One radiance field: lookup -> f1 -> H -> f2 -> colour and density. Coarse and fine are two of these over one encoder."""

from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.density.base import AbstractDensity, TrunkOutput
from charnerf.models.heads.base import AbstractHead
from charnerf.models.inputs import PointInputs
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import MultiView
from charnerf.scene import DensityOutput
from charnerf.types import FieldOutput, TensorRecord


@final
class Field(nn.Module):
    """A radiance field conditioned on source views.

    Args:
        single_view: f1.
        combinator: H.
        density: Which stages see the query direction.
        head: The colour head.
        activation: From raw values to densities in 1/m.
        feature_channels: F, of the encoder.
        width: D.
        num_multi_view_blocks: Blocks of f2.

    Source: paper, Overview and Fig. network.
    """

    def __init__(
        self,
        *,
        single_view: AbstractSingleView,
        combinator: AbstractCombinator,
        density: AbstractDensity,
        head: AbstractHead,
        activation: nn.Module,
        feature_channels: int,
        width: int,
        num_multi_view_blocks: int,
    ) -> None:
        super().__init__()
        self.from_latents = nn.Linear(feature_channels, single_view.latent_size)
        self.single_view = single_view
        self.combinator = combinator
        self.multi_view = MultiView(width=width, num_blocks=num_multi_view_blocks)
        self.density = density
        self.head = head
        self.activation = activation

    def forward(self, inputs: PointInputs) -> FieldOutput:
        """Colours (P, 3) and densities (P,) of points as the views see them; latents come through `from_latents`."""
        trunk = self.trunk(inputs)
        rgb = self.colors(trunk, inputs)
        return FieldOutput(rgb=rgb, densities=self.kept_densities(trunk, inputs))

    def densities(self, inputs: PointInputs) -> DensityOutput:
        """Densities (P,) of points, and what `colors` needs of them: `forward` in two steps."""
        trunk = self.trunk(inputs)
        # what only the trunk reads need not be kept
        seen = replace(inputs, latents=inputs.latents[..., :0], point_features=inputs.point_features[..., :0])
        return DensityOutput(self.kept_densities(trunk, inputs), PendingColors(trunk, seen))

    def trunk(self, inputs: PointInputs) -> TrunkOutput:
        """What the densities of points (P) need: f1, H and f2, each with the direction that it may see."""
        return self.fuse(self.view_features(inputs), inputs)

    def view_features(self, inputs: PointInputs) -> Tensor:
        """V^(i) (P, V, D): f1."""
        return self.single_view(inputs, _seen(inputs.view_dirs, self.density.f1_sees_directions))

    def fuse(self, view_features: Tensor, inputs: PointInputs) -> TrunkOutput:
        """What H and f2 make of V^(i) (P, V, D)."""
        dirs = _seen(inputs.view_dirs, self.density.combinator_sees_directions)
        fused = self.combinator(view_features, dirs, inputs.source_dirs, inputs.valid)
        features, raw = self.multi_view(fused, _seen(inputs.view_dirs, self.density.f2_sees_directions))
        return TrunkOutput(raw_densities=raw, features=features, view_features=view_features)

    def kept_densities(self, trunk: TrunkOutput, inputs: PointInputs) -> Tensor:
        """Densities (P,), 1/m."""
        densities: Tensor = self.activation(trunk.raw_densities) * inputs.kept
        return densities

    def colors(self, trunk: TrunkOutput, inputs: PointInputs) -> Tensor:
        """Colours (P, 3)."""
        features = self.density.color_features(
            trunk, inputs.view_dirs, inputs.source_dirs, inputs.valid, self.combinator
        )
        return self.head(features, trunk.view_features, inputs)

    def hoist(self, rows: Tensor) -> Tensor:
        """Apply the linear layer of the features to the maps' rows (N, F) -> (N, D), once instead of at every point.

        Bilinear reading commutes with a linear map (its weights sum to 1, so with the bias too): equal to rounding.
        """
        return self.from_latents(rows)


def _seen(view_dirs: Tensor, sees_directions: bool) -> Tensor:
    """Directions (P, 3), or the zero direction as one row for all points."""
    return view_dirs if sees_directions else torch.zeros_like(view_dirs[:1])


@dataclass(frozen=True)
class PendingColors(TensorRecord):
    """What colours of points are made of, once their densities are there."""

    trunk: TrunkOutput
    inputs: PointInputs
