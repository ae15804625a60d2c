"""Only colour and blending see directions (beyond the paper): the density is one number a point, as a mesh needs it."""

from typing import final

import torch
from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.density.base import AbstractDensity, TrunkOutput
from charnerf.models.inputs import PointInputs
from charnerf.models.mlp import ResidualBlock
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import DIRECTION_FREQUENCIES, MultiView, encode_directions


@final
class ViewFreeDensity(AbstractDensity):
    """sigma = f2(H(f1(W(x)))) without a direction; a block of its own adds d, and H's answer to d, for the colour.

    Args:
        width: D.
    """

    sees_directions = False

    def __init__(self, *, width: int) -> None:
        super().__init__()
        self.from_dirs = nn.Linear(6 * DIRECTION_FREQUENCIES, width)
        self.colour = ResidualBlock(width=width)

    def trunk(
        self,
        inputs: PointInputs,
        single_view: AbstractSingleView,
        combinator: AbstractCombinator,
        multi_view: MultiView,
    ) -> TrunkOutput:
        """Run the trunk without a direction; the zero direction is one row for all points."""
        no_direction = torch.zeros_like(inputs.view_dirs[:1])
        view_features = single_view(inputs, no_direction)
        fused = combinator(view_features, no_direction, inputs.source_dirs, inputs.valid)
        features, raw = multi_view(fused, no_direction)
        return TrunkOutput(raw_densities=raw, features=features, view_features=view_features)

    def directed(self, trunk: TrunkOutput, inputs: PointInputs, combinator: AbstractCombinator) -> Tensor:
        """The colour block: the trunk's features, the direction, and what the combinator answers to it."""
        directed = trunk.features + self.from_dirs(encode_directions(inputs.view_dirs))
        if combinator.sees_query:
            directed = directed + combinator(
                trunk.view_features, inputs.view_dirs, inputs.source_dirs, inputs.valid
            )
        return self.colour(directed)
