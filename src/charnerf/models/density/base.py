"""Which stages of a field see the query direction."""

from dataclasses import dataclass

from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.inputs import PointViews
from charnerf.types import TensorRecord


@dataclass(frozen=True)
class TrunkOutput(TensorRecord):
    """raw densities (P,), features for the colour head (P, D), features by view (P, V, D), H's projections of those (P, V, C)."""

    raw_densities: Tensor
    features: Tensor
    view_features: Tensor
    projected: Tensor


class AbstractDensity(nn.Module):
    """Says which stages see the query direction; the others get the zero direction.

    Attributes:
        f1_sees_directions: Whether f1 does.
        combinator_sees_directions: Whether H does.
        f2_sees_directions: Whether f2 does.
    """

    f1_sees_directions: bool
    combinator_sees_directions: bool
    f2_sees_directions: bool

    @property
    def sees_directions(self) -> bool:
        """Whether the density depends on the query direction."""
        return self.f1_sees_directions or self.combinator_sees_directions or self.f2_sees_directions

    def color_features(
        self, trunk: TrunkOutput, views: PointViews, view_dirs: Tensor, combinator: AbstractCombinator
    ) -> Tensor:
        """Features (P, D) for the colour head; those of the trunk, where they have the query direction in them.

        Args:
            trunk: What the stages made of points (P).
            views: What the source views show of them.
            view_dirs: (P, 3).
            combinator: H.
        """
        return trunk.features
