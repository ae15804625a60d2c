"""Directions enter f1 alone, as pixelNeRF: density depends on them, H and f2 do not see them."""

from typing import final

import torch
from torch import Tensor

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.density.base import AbstractDensity, TrunkOutput
from charnerf.models.inputs import PointInputs
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import MultiView


@final
class SingleViewDensity(AbstractDensity):
    """(c, sigma) = f2(H(f1(W(x), d))).

    Args:
        width: D (no weights are built).

    Source: pixelNeRF (Yu 2021), whose first layer alone reads the direction.
    """

    sees_directions = True

    def __init__(self, *, width: int) -> None:
        super().__init__()

    def trunk(
        self,
        inputs: PointInputs,
        single_view: AbstractSingleView,
        combinator: AbstractCombinator,
        multi_view: MultiView,
    ) -> TrunkOutput:
        """Run the trunk with the query direction in f1; the zero direction behind it is one row for all points."""
        view_features = single_view(inputs, inputs.view_dirs)
        no_direction = torch.zeros_like(inputs.view_dirs[:1])
        fused = combinator(view_features, no_direction, inputs.source_dirs, inputs.valid)
        features, raw = multi_view(fused, no_direction)
        return TrunkOutput(raw_densities=raw, features=features, view_features=view_features)

    def directed(self, trunk: TrunkOutput, inputs: PointInputs, combinator: AbstractCombinator) -> Tensor:
        """The trunk's features: they have the direction already."""
        return trunk.features
