"""What a field reads of each view beside the encoder's features."""

from abc import ABC, abstractmethod

from torch import Tensor

from charnerf.models.inputs import FieldInputs


class AbstractFeatures(ABC):
    """Chooses the further inputs of f1.

    Attributes:
        num_point_features: E, further inputs per view.
        reads_hull: Whether the hull's maps are read.
        reads_sections: Whether the hull's cross-sections are read.
    """

    num_point_features: int
    reads_hull: bool
    reads_sections: bool = False

    @abstractmethod
    def __call__(self, inputs: FieldInputs) -> Tensor:
        """Return the further inputs, (P, V, E)."""
