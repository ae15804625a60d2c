"""Where the point lies with respect to the hull, as each view sees it (beyond the paper)."""

from typing import final

import torch
from torch import Tensor

from charnerf.models.features.base import AbstractFeatures
from charnerf.models.inputs import FieldInputs

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

    def __call__(self, inputs: FieldInputs) -> Tensor:
        """Return (P, V, 16), feature by feature in memory."""
        has_no_say = (inputs.mirrored > 0) & (inputs.mirrored == 0).any()
        smallest = inputs.edge.masked_fill(has_no_say, torch.inf).amin(-1, keepdim=True)
        planes = (
            _at_scales(inputs.views.behind, DEPTH_SCALES),
            _at_scales(inputs.edge, EDGE_SCALES),
            _at_scales(smallest, EDGE_SCALES).expand(-1, *inputs.edge.shape),
            inputs.mirrored.expand(1, *inputs.edge.shape),
            (2.0 * inputs.views.rgb - 1.0).permute(2, 0, 1),
            inputs.views.dirs.permute(2, 0, 1),
        )
        return torch.cat(planes).permute(1, 2, 0)


def _at_scales(values: Tensor, scales: tuple[float, ...]) -> Tensor:
    """Values (P, V) times scales (S), bounded, (S, P, V)."""
    return torch.tanh(values * values.new_tensor(scales)[:, None, None])
