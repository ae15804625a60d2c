"""Only colour and blending see directions (beyond the paper): the density is one number a point, as a mesh needs it."""

from typing import final

from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.density.base import AbstractDensity, TrunkOutput
from charnerf.models.fused import once
from charnerf.models.inputs import PointViews
from charnerf.models.mlp import ResidualBlock
from charnerf.models.stages import DIRECTION_FREQUENCIES, encode_directions


@final
class ViewFreeDensity(AbstractDensity):
    """sigma = f2(H(f1(W(x)))) without a direction; a block of its own adds d, and H's answer to d, for the colour.

    Args:
        width: D.
    """

    f1_sees_directions = False
    combinator_sees_directions = False
    f2_sees_directions = False

    def __init__(self, *, width: int) -> None:
        super().__init__()
        self.from_dirs = nn.Linear(6 * DIRECTION_FREQUENCIES, width)
        self.color = ResidualBlock(width=width)

    def color_features(
        self, trunk: TrunkOutput, views: PointViews, view_dirs: Tensor, combinator: AbstractCombinator
    ) -> Tensor:
        """The trunk's features, the direction, and what the combinator answers to it, through the colour block."""
        directed = trunk.features + self.from_dirs(encode_directions(once(view_dirs)))
        if combinator.sees_query:
            directed = directed + combinator.answer(
                trunk.view_features, trunk.projected, view_dirs, views.dirs, views.valid
            )
        return self.color(directed)
