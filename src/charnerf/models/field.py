"""One radiance field: lookup -> f1 -> H -> f2 -> colour and density. Coarse and fine are two of these over one encoder."""

from typing import final

import torch
from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.density.base import AbstractDensity, TrunkOutput
from charnerf.models.features.base import AbstractFeatures
from charnerf.models.heads.base import AbstractHead
from charnerf.models.inputs import FieldInputs, PointViews
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import MultiView
from charnerf.types import FieldOutput


@final
class Field(nn.Module):
    """A radiance field conditioned on source views.

    Args:
        features: Further inputs of f1.
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
        features: AbstractFeatures,
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
        self.features = features
        self.from_latents = nn.Linear(feature_channels, single_view.latent_size)
        self.single_view = single_view
        self.combinator = combinator
        self.multi_view = MultiView(width=width, num_blocks=num_multi_view_blocks)
        self.density = density
        self.head = head
        self.activation = activation

    def forward(self, inputs: FieldInputs, view_dirs: Tensor) -> FieldOutput:
        """Colours (P, 3) and densities (P,) of points looked at along view_dirs (P, 3)."""
        trunk = self.trunk(inputs, view_dirs)
        rgb = self.colors(trunk, inputs.views, view_dirs)
        return FieldOutput(rgb=rgb, densities=self.densities(trunk, inputs.kept))

    def trunk(self, inputs: FieldInputs, view_dirs: Tensor) -> TrunkOutput:
        """What the densities of points (P) need: f1, H and f2, each with the direction that it may see."""
        return self.fuse(self.view_features(inputs, view_dirs), inputs.views, view_dirs)

    def view_features(self, inputs: FieldInputs, view_dirs: Tensor) -> Tensor:
        """V^(i) (P, V, D): f1."""
        dirs = _seen(view_dirs, self.density.f1_sees_directions)
        return self.single_view(inputs, self.features(inputs), dirs)

    def fuse(self, view_features: Tensor, views: PointViews, view_dirs: Tensor) -> TrunkOutput:
        """What H and f2 make of V^(i) (P, V, D)."""
        dirs = _seen(view_dirs, self.density.combinator_sees_directions)
        projected = self.combinator.project(view_features)
        fused = self.combinator.answer(view_features, projected, dirs, views.dirs, views.valid)
        features, raw = self.multi_view(fused, _seen(view_dirs, self.density.f2_sees_directions))
        return TrunkOutput(raw, features, view_features, projected)

    def densities(self, trunk: TrunkOutput, kept: Tensor) -> Tensor:
        """Densities (P,), 1/m, of which the drawings leave a share `kept` (P,), all where it is above 1."""
        densities: Tensor = self.activation(trunk.raw_densities) * kept.clamp_max(1.0)
        return densities

    def colors(self, trunk: TrunkOutput, views: PointViews, view_dirs: Tensor) -> Tensor:
        """Colours (P, 3)."""
        return self.head.rgb_of(self.appearance(trunk, views, view_dirs), views.rgb)

    def appearance(self, trunk: TrunkOutput, views: PointViews, view_dirs: Tensor) -> Tensor:
        """What the head makes colours of, (P, C)."""
        features = self.density.color_features(trunk, views, view_dirs, self.combinator)
        return self.head.appearance(features, trunk.view_features, views, view_dirs)

    def hoist(self, rows: Tensor) -> Tensor:
        """Apply the linear layer of the features to the maps' rows (N, F) -> (N, D), once instead of at every point.

        Bilinear reading commutes with a linear map (its weights sum to 1, so with the bias too): equal to rounding.
        """
        latents: Tensor = self.from_latents(rows)
        return latents


def _seen(view_dirs: Tensor, sees_directions: bool) -> Tensor:
    """Directions (P, 3), or the zero direction as one row for all points."""
    return view_dirs if sees_directions else torch.zeros_like(view_dirs[:1])
