"""Hull and cross-sections, and how well the drawings' colours agree at the point (beyond the paper)."""

from typing import final

import torch
from torch import Tensor

from charnerf.models.features.base import AbstractFeatures, ViewReadings
from charnerf.models.features.image_hull_section import ImageHullSectionFeatures


@final
class ImageHullSectionConsistencyFeatures(AbstractFeatures):
    """What `image_hull_section` reads, and photo-consistency: a surface has one colour in all drawings that see it.

    f1 sees each drawing by itself and can not compare. By view: its colour's distance to the one nearest to it among the other
    views, at two scales, the mean distance to them, the difference from their mean. Over all: the smallest distance of any two
    views, and the mean of the nearest ones. Zeros where there is one view only.
    """

    num_extras = ImageHullSectionFeatures.num_extras + 8
    reads_hull = True
    reads_sections = True

    def __init__(self) -> None:
        self.image_hull_section = ImageHullSectionFeatures()

    def __call__(self, readings: ViewReadings) -> Tensor:
        """Return (P, V, 36)."""
        return torch.cat((self.image_hull_section(readings), consistency(readings.source_rgb)), dim=-1)


def consistency(rgb: Tensor) -> Tensor:
    """Agreement of colours (P, V, 3) between views, (P, V, 8)."""
    num_views = rgb.shape[1]
    if num_views < 2:
        return rgb.new_zeros(*rgb.shape[:2], 8)
    views = rgb.unbind(1)
    apart: list[list[Tensor]] = [[] for _ in views]
    for i, one in enumerate(views):
        for j in range(i):
            distance = (one - views[j]).square().sum(-1)
            apart[i].append(distance)
            apart[j].append(distance)
    distances = torch.stack([torch.stack(row, dim=-1) for row in apart], dim=1).add(1e-8).sqrt()
    nearest = distances.amin(-1)
    smallest = nearest.amin(1, keepdim=True).expand_as(nearest)
    scalars = torch.stack(
        (
            torch.tanh(2.0 * nearest),
            torch.tanh(8.0 * nearest),
            torch.tanh(4.0 * smallest),
            distances.mean(-1),
            nearest.mean(1, keepdim=True).expand_as(nearest),
        ),
        dim=-1,
    )
    others = (rgb.sum(1, keepdim=True) - rgb) / (num_views - 1)
    return torch.cat((scalars, rgb - others), dim=-1)
