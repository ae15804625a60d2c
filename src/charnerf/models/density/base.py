"""How the query direction enters: the wiring of f1, H and f2."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.inputs import PointInputs
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import MultiView
from charnerf.types import TensorRecord


@dataclass(frozen=True)
class TrunkOutput(TensorRecord):
    """raw densities (P,), features for the colour head (P, D) and per-view features (P, V, D)."""

    raw_densities: Tensor
    features: Tensor
    view_features: Tensor


class AbstractDensity(nn.Module, ABC):
    """The wiring of f1, H and f2 from inputs to raw density and colour features.

    Attributes:
        sees_directions: Whether the density depends on the query direction.
    """

    sees_directions: bool

    @abstractmethod
    def trunk(
        self,
        inputs: PointInputs,
        single_view: AbstractSingleView,
        combinator: AbstractCombinator,
        multi_view: MultiView,
    ) -> TrunkOutput:
        """Run what the densities of points (P) need; features are those before `directed`."""

    @abstractmethod
    def directed(self, trunk: TrunkOutput, inputs: PointInputs, combinator: AbstractCombinator) -> Tensor:
        """Features (P, D) for the colour head, with the query direction in them; needed only where colours are."""

    def forward(
        self,
        inputs: PointInputs,
        single_view: AbstractSingleView,
        combinator: AbstractCombinator,
        multi_view: MultiView,
    ) -> TrunkOutput:
        """Run the trunk for points (P), features directed."""
        trunk = self.trunk(inputs, single_view, combinator, multi_view)
        return replace(trunk, features=self.directed(trunk, inputs, combinator))
