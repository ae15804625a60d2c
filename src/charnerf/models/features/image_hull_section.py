"""Hull features, and where the point lies in the hull's cross-section (beyond the paper)."""

from typing import final

import torch
from torch import Tensor

from charnerf.models.features.base import AbstractFeatures
from charnerf.models.features.image_hull import ImageHullFeatures
from charnerf.models.inputs import FieldInputs

LENGTH_SCALE = 1.0 / 18.0  # of the box's half-extent: half of an arm's thickness, 0.1 m of 1.8
LEAST_LENGTH = 0.01 * LENGTH_SCALE


@final
class ImageHullSectionFeatures(AbstractFeatures):
    """The hull as each view sees it, and the place in its cross-sections along the world's axes, alike for all views.

    Places u in [-1, 1] and their squares; the squares' sums by twos, 1 on the ellipse that touches the run's ends: what lies beyond
    is a corner that only the hull has; logarithms of the runs' half-lengths.
    """

    num_point_features = ImageHullFeatures.num_point_features + 12
    reads_hull = True
    reads_sections = True

    def __init__(self) -> None:
        self.image_hull = ImageHullFeatures()

    def __call__(self, inputs: FieldInputs) -> Tensor:
        """Return (P, V, 28), feature by feature in memory."""
        places, halves = inputs.section_places, inputs.section_lengths
        squares = places.square()
        lengths = (torch.log2(halves.clamp_min(LEAST_LENGTH) / LENGTH_SCALE) / 3.0).clamp(-1.0, 1.0)
        section = torch.cat((places, squares, squares + squares.roll(1, dims=-1), lengths), dim=-1)
        by_view = self.image_hull(inputs)
        alike = section.t()[..., None].expand(-1, -1, by_view.shape[1])
        return torch.cat((by_view.permute(2, 0, 1), alike)).permute(1, 2, 0)
