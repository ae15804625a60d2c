"""Characters with left and right exchanged."""

from dataclasses import replace
from typing import final

import torch
from torch import Tensor

from charnerf.data.augmentation.base import AbstractAugmentation
from charnerf.geometry.cameras import mirror_views
from charnerf.types import Hull, RayBundle, TrainBatch


@final
class Mirror(AbstractAugmentation):
    """Left and right exchanged.

    Args:
        share: Of the characters, in [0, 1].
    """

    num_draws = 1

    def __init__(self, *, share: float) -> None:
        self.share = share

    def __call__(self, batch: TrainBatch, draws: Tensor, generator: torch.Generator) -> TrainBatch:
        """Return the batch of the mirrored characters, or as it is."""
        return mirror(batch) if draws[0] < self.share else batch


def mirror(batch: TrainBatch) -> TrainBatch:
    """The batch of the characters mirrored in the plane x = 0: drawings, hulls, rays and points alike."""
    flip = batch.rays.origins.new_tensor((-1.0, 1.0, 1.0))
    points, space = batch.surface, batch.space
    return replace(
        batch,
        views=mirror_views(batch.views),
        hull=None if batch.hull is None else _mirror_hull(batch.hull),
        rays=RayBundle(origins=batch.rays.origins * flip, directions=batch.rays.directions * flip),
        surface=None if points is None else replace(points, points=points.points * flip),
        space=None if space is None else replace(space, points=space.points * flip),
    )


def _mirror_hull(hull: Hull) -> Hull:
    low, high = hull.box_min.clone(), hull.box_max.clone()
    low[:, 0], high[:, 0] = -hull.box_max[:, 0], -hull.box_min[:, 0]
    return replace(
        hull,
        occupancy=hull.occupancy.flip(1),
        box_min=low,
        box_max=high,
        front_depths=hull.front_depths.flip(-1),
        edge_distances=hull.edge_distances.flip(-1),
    )
