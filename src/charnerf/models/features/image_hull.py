"""Where the point lies with respect to the hull, as each view sees it (beyond the paper)."""

from typing import final

import torch
from torch import Tensor

from charnerf.models.features.base import AbstractFeatures, ViewReadings

DEPTH_SCALES = (4.0, 20.0, 80.0)  # per half-extent: a torso, an arm, a surface
EDGE_SCALES = (8.0, 40.0, 160.0)  # per picture side


@final
class ImageHullFeatures(AbstractFeatures):
    """Where the point lies with respect to the hull, by view and over all views, at three scales each.

    By view: signed depth behind the hull's front, distance to the mask's edge; colour, direction, mirrored flag. Over all: the
    smallest edge distance, because a point is empty as soon as one drawing says so, which an average over views can not tell;
    mirrored views have no say in it.
    """

    num_point_features = len(DEPTH_SCALES) + 2 * len(EDGE_SCALES) + 3 + 3 + 1
    reads_hull = True

    def __call__(self, readings: ViewReadings) -> Tensor:
        """Return (P, V, 16)."""
        depths = [torch.tanh(scale * readings.behind) for scale in DEPTH_SCALES]
        edges = [torch.tanh(scale * readings.edge) for scale in EDGE_SCALES]
        has_no_say = (readings.mirrored > 0) & (readings.mirrored == 0).any()
        smallest = (
            readings.edge.masked_fill(has_no_say, torch.inf).amin(-1, keepdim=True).expand_as(readings.edge)
        )
        smallests = [torch.tanh(scale * smallest) for scale in EDGE_SCALES]
        mirrored = readings.mirrored.expand_as(readings.behind)
        scalars = torch.stack((*depths, *edges, *smallests, mirrored), dim=-1)
        return torch.cat((scalars, 2.0 * readings.source_rgb - 1.0, readings.source_dirs), dim=-1)
