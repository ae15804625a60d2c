"""Directions enter f1, H and f2, so that density depends on them, as the paper."""

from typing import final

from torch import Tensor

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.density.base import AbstractDensity, TrunkOutput
from charnerf.models.inputs import PointInputs
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import MultiView


@final
class ViewDependentDensity(AbstractDensity):
    """(c, sigma) = f2(H(f1(W(x), d)), d).

    Args:
        width: D (unused weights are not built).
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
        """Run the trunk with the query direction everywhere."""
        view_features = single_view(inputs, inputs.view_dirs)
        fused = combinator(view_features, inputs.view_dirs, inputs.source_dirs, inputs.valid)
        features, raw = multi_view(fused, inputs.view_dirs)
        return TrunkOutput(raw_densities=raw, features=features, view_features=view_features)

    def directed(self, trunk: TrunkOutput, inputs: PointInputs, combinator: AbstractCombinator) -> Tensor:
        """The trunk's features: they have the direction already."""
        return trunk.features
