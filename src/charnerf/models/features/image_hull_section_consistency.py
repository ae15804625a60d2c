"""Hull and cross-sections, and how well the drawings' colours agree at the point (beyond the paper)."""

from functools import reduce
from typing import final

import torch
from torch import Tensor

from charnerf.models.features.base import AbstractFeatures
from charnerf.models.features.image_hull_section import ImageHullSectionFeatures
from charnerf.models.inputs import FieldInputs


@final
class ImageHullSectionConsistencyFeatures(AbstractFeatures):
    """What `image_hull_section` reads, and photo-consistency: a surface has one colour in all drawings that see it.

    f1 sees each drawing by itself and can not compare. By view: its colour's distance to the one nearest to it among the other
    views, at two scales, the mean distance to them, the difference from their mean. Over all: the smallest distance of any two
    views, and the mean of the nearest ones. Zeros where there is one view only.
    """

    num_point_features = ImageHullSectionFeatures.num_point_features + 8
    reads_hull = True
    reads_sections = True

    def __init__(self) -> None:
        self.image_hull_section = ImageHullSectionFeatures()

    def __call__(self, inputs: FieldInputs) -> Tensor:
        """Return (P, V, 36), feature by feature in memory."""
        parts = self.image_hull_section(inputs), consistency(inputs.views.rgb)
        return torch.cat([part.permute(2, 0, 1) for part in parts]).permute(1, 2, 0)


def consistency(rgb: Tensor) -> Tensor:
    """Agreement of colours (P, V, 3) between views, (P, V, 8)."""
    num_views = rgb.shape[1]
    if num_views < 2:
        return rgb.new_zeros(*rgb.shape[:2], 8)
    colors = rgb.permute(1, 2, 0).contiguous()  # (V, 3, P): points in a row, or each pair strides over memory
    apart: list[list[Tensor]] = [[] for _ in range(num_views)]
    for i in range(num_views):
        for j in range(i):
            distance = (colors[i] - colors[j]).square().sum(0).add(1e-8).sqrt()
            apart[i].append(distance)
            apart[j].append(distance)
    nearest = torch.stack([reduce(torch.minimum, row) for row in apart])
    mean = torch.stack([reduce(torch.add, row) for row in apart]) / (num_views - 1)
    scalars = (
        torch.tanh(2.0 * nearest),
        torch.tanh(8.0 * nearest),
        torch.tanh(4.0 * nearest.amin(0)).expand_as(nearest),
        mean,
        nearest.mean(0).expand_as(nearest),
    )
    others = (colors.sum(0) - colors) / (num_views - 1)
    return torch.cat((torch.stack(scalars, dim=1), colors - others), dim=1).permute(2, 0, 1)
