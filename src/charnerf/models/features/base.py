"""What a field reads of each view beside the encoder's features."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from torch import Tensor


@dataclass(frozen=True)
class ViewReadings:
    """Raw readings at the projections of points (P) into views (V).

    Attributes:
        source_rgb: (P, V, 3), colour of the drawings.
        behind: (P, V), distance behind the hull's front, in half-extents of the box; negative in front; 0 without a hull.
        edge: (P, V), distance from the mask's edge as a share of the picture's side; positive inside; 0 without a hull.
        source_dirs: (P, V, 3), unit.
        mirrored: (V,), 1 where the view is a mirrored one.
    """

    source_rgb: Tensor
    behind: Tensor
    edge: Tensor
    source_dirs: Tensor
    mirrored: Tensor


class AbstractFeatures(ABC):
    """Chooses the further inputs of f1.

    Attributes:
        num_extras: E, further inputs per view.
        reads_hull: Whether the hull's maps are read.
    """

    num_extras: int
    reads_hull: bool

    @abstractmethod
    def __call__(self, readings: ViewReadings) -> Tensor:
        """Return the further inputs, (P, V, E)."""
