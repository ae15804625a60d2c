"""Where the point lies with respect to the hull, as each view sees it (beyond the paper)."""

from typing import final

import torch
from torch import Tensor

from charnerf.models.features.base import AbstractFeatures, ViewReadings

DEPTH_SCALES = (4.0, 20.0, 80.0)  # per half-extent: a torso, an arm, a surface
EDGE_SCALES = (8.0, 40.0, 160.0)  # per picture side


@final
class ImageHullFeatures(AbstractFeatures):
    """Signed depth behind the hull's front and distance to the mask's edge, at three scales; colour, direction, mirrored flag."""

    num_extras = len(DEPTH_SCALES) + len(EDGE_SCALES) + 3 + 3 + 1
    reads_hull = True

    def __call__(self, readings: ViewReadings) -> Tensor:
        """Return (P, V, 13)."""
        depths = [torch.tanh(scale * readings.behind) for scale in DEPTH_SCALES]
        edges = [torch.tanh(scale * readings.edge) for scale in EDGE_SCALES]
        mirrored = readings.mirrored.expand_as(readings.behind)
        scalars = torch.stack((*depths, *edges, mirrored), dim=-1)
        return torch.cat((scalars, 2.0 * readings.source_rgb - 1.0, readings.source_dirs), dim=-1)
