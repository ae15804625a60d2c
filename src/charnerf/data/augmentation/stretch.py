"""Characters in other proportions.

An affine map of the world takes rays to rays, so that captured pictures stay true of the stretched character; orthographic drawings
seen along an axis only change their width.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import final

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.data.augmentation.base import AbstractAugmentation
from charnerf.types import Cameras, Hull, RayBundle, SourceViews, TrainBatch

ALIGNED = 0.999  # |cosine| of a viewing axis and a world axis


@final
class Stretch(AbstractAugmentation):
    """Width and depth by random factors, where all source views are orthographic and look along an axis.

    Args:
        share: Of the characters, in [0, 1].
        width_range: Factors on the width, smallest and largest; above 1.05 arms may leave the drawing's frame.
        depth_range: Factors on the depth.
        used_views: The model's rule from drawings to views; a hull has maps for all of those.
    """

    num_draws = 3

    def __init__(
        self,
        *,
        share: float,
        width_range: list[float],
        depth_range: list[float],
        used_views: Callable[[SourceViews], SourceViews],
    ) -> None:
        self.share = share
        self.width_range = width_range
        self.depth_range = depth_range
        self.used_views = used_views

    def __call__(self, batch: TrainBatch, draws: Tensor, generator: torch.Generator) -> TrainBatch:
        """Return the batch of the stretched characters, or as it is."""
        if draws[0] >= self.share or not can_stretch(batch.views):
            return batch
        factors = (_between(self.width_range, draws[1]), _between(self.depth_range, draws[2]), torch.ones(()))
        return stretch(batch, torch.stack(factors), self.used_views(batch.views).cameras)


def _between(bounds: list[float], share: Tensor) -> Tensor:
    return bounds[0] + share * (bounds[1] - bounds[0])


def can_stretch(views: SourceViews) -> bool:
    """Whether all source views are orthographic, level and look along the x or y axis."""
    axes = views.cameras.world_from_camera[..., :3, 2].abs()
    return bool(views.cameras.orthographic.all()) and bool((axes[..., :2].amax(-1) > ALIGNED).all())


def stretch(batch: TrainBatch, scales: Tensor, used_cameras: Cameras) -> TrainBatch:
    """Stretch the world of a batch by factors along x and y.

    Args:
        batch: Its source views pass `can_stretch`.
        scales: (3,), the last 1: heights stay.
        used_cameras: Cameras (B, V') of the hull's maps.

    Returns:
        The batch of the stretched characters.
    """
    directions = batch.rays.directions * scales
    lengths = directions.norm(dim=-1)
    points = batch.surface
    space = batch.space
    return replace(
        batch,
        views=stretch_views(batch.views, scales),
        hull=None if batch.hull is None else _stretch_hull(batch.hull, used_cameras, scales),
        rays=RayBundle(origins=batch.rays.origins * scales, directions=directions / lengths[..., None]),
        depth=None if batch.depth is None else batch.depth * lengths,
        surface=None if points is None else replace(points, points=points.points * scales),
        space=None if space is None else replace(space, points=space.points * scales),
    )


def stretch_views(views: SourceViews, scales: Tensor) -> SourceViews:
    """Drawings of the stretched character; each is resampled in width about its principal point."""
    cameras = views.cameras
    across = _across(cameras, scales)
    rgb, alpha = views.images[:, :, :3], views.images[:, :, 3:]
    resampled = _widen(torch.cat((rgb * alpha, alpha), dim=2), across, cameras, padding="zeros")
    alpha = resampled[:, :, 3:]
    images = torch.cat((resampled[:, :, :3] / alpha.clamp_min(1e-4), alpha), dim=2).clamp(0.0, 1.0)
    widened = views.widened_alphas
    if widened is not None:
        widened = _widen(widened[:, :, None], across, cameras, padding="border")[:, :, 0]
    pose = cameras.world_from_camera.clone()
    pose[..., :3, 3] = pose[..., :3, 3] * scales
    cameras = replace(cameras, world_from_camera=pose)
    return replace(views, images=images, cameras=cameras, widened_alphas=widened)


def _across(cameras: Cameras, scales: Tensor) -> Tensor:
    """Factor on the width of each view's picture, (B, V)."""
    return (cameras.world_from_camera[..., :3, 0].abs() * scales).sum(-1)


def _stretch_hull(hull: Hull, cameras: Cameras, scales: Tensor) -> Hull:
    """The hull of the stretched character: its box and maps; edge distances change by the mean of the two factors."""
    across = _across(cameras, scales)
    along = (cameras.world_from_camera[..., :3, 2].abs() * scales).sum(-1)
    maps = torch.stack((hull.front_depths, hull.edge_distances), dim=2)
    depths, edges = _widen(maps, across, cameras, padding="border").unbind(2)
    return replace(
        hull,
        box_min=hull.box_min * scales,
        box_max=hull.box_max * scales,
        front_depths=depths * along[..., None, None],
        edge_distances=edges * (0.5 + 0.5 * across)[..., None, None],
    )


def _widen(maps: Tensor, factors: Tensor, cameras: Cameras, *, padding: str) -> Tensor:
    """Resample maps (B, V, C, h, w) in width by factors (B, V) about the principal point."""
    batch, views, _, height, width = maps.shape
    centre = (2.0 * cameras.principal_point[..., 0] / cameras.width - 1.0)[..., None]
    x = (torch.arange(width, dtype=maps.dtype) + 0.5) * (2.0 / width) - 1.0
    x = centre + (x - centre) / factors[..., None]
    y = (torch.arange(height, dtype=maps.dtype) + 0.5) * (2.0 / height) - 1.0
    grid = torch.stack(
        (x[:, :, None, :].expand(-1, -1, height, -1), y[:, None].expand(batch, views, height, width)), dim=-1
    )
    widened = F.grid_sample(maps.flatten(0, 1), grid.flatten(0, 1), padding_mode=padding, align_corners=False)
    return widened.unflatten(0, (batch, views))
