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
        places: (P, 3), where the point lies in the hull's runs along the world's axes, ends at -1 and 1; 0 if not asked for.
        half_lengths: (P, 3), of those runs, in half-extents of the box; 0 if not asked for.
    """

    source_rgb: Tensor
    behind: Tensor
    edge: Tensor
    source_dirs: Tensor
    mirrored: Tensor
    places: Tensor
    half_lengths: Tensor


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
    def __call__(self, readings: ViewReadings) -> Tensor:
        """Return the further inputs, (P, V, E)."""
