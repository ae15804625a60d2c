"""More characters from the ones there are: other proportions, colours, left and right, the drawings and the rays changed alike.

An affine map of the world takes rays to rays, so that the captured pictures stay true of the stretched character; orthographic
drawings seen along an axis only change their width. Or the drawings become drawn ones, and the rays stay true.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import final

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.data.drawing_style import draw_pictures, random_style
from charnerf.geometry.cameras import mirror_views
from charnerf.types import Cameras, Hull, RayBundle, SourceViews, TrainBatch

ALIGNED = 0.999  # |cosine| of a viewing axis and a world axis


class AbstractAugmentation(ABC):
    """A random change of a training batch."""

    @abstractmethod
    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch changed at random."""


@final
class NoAugmentation(AbstractAugmentation):
    """Batches as they are."""

    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch."""
        return batch


@final
class MirrorAndRecolor(AbstractAugmentation):
    """Training characters with left and right or colour channels exchanged.

    Args:
        mirror_share: Share of the steps whose characters change left and right.
        recolor_share: Share of the steps whose colour channels are permuted.
    """

    def __init__(self, *, mirror_share: float, recolor_share: float) -> None:
        self.mirror_share = mirror_share
        self.recolor_share = recolor_share

    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch changed at random."""
        draws = torch.rand(2, generator=generator)
        if draws[0] < self.recolor_share:
            batch = recolor(batch, torch.randperm(3, generator=generator))
        return mirror(batch) if draws[1] < self.mirror_share else batch


@final
class StretchAndRecolor(AbstractAugmentation):
    """Random proportions and colours of training characters.

    Args:
        stretch_share: Share of the steps whose characters are stretched in width and depth.
        width_range: Factors on the width, smallest and largest; above 1.05 arms may leave the drawing's frame.
        depth_range: Factors on the depth.
        mirror_share: See MirrorAndRecolor, as the next.
        recolor_share: Of the steps.
        used_views: The model's rule from drawings to views; a hull has maps for all of those.
    """

    def __init__(
        self,
        *,
        stretch_share: float,
        width_range: list[float],
        depth_range: list[float],
        mirror_share: float,
        recolor_share: float,
        used_views: Callable[[SourceViews], SourceViews],
    ) -> None:
        self.used_views = used_views
        self.stretch_share = stretch_share
        self.width_range = width_range
        self.depth_range = depth_range
        self.exchange = MirrorAndRecolor(mirror_share=mirror_share, recolor_share=recolor_share)

    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch changed at random."""
        draws = torch.rand(3, generator=generator)
        if draws[0] < self.stretch_share and can_stretch(batch.views):
            scales = torch.stack(
                (_between(self.width_range, draws[1]), _between(self.depth_range, draws[2]), torch.ones(()))
            )
            batch = stretch(batch, scales, self.used_views(batch.views).cameras)
        return self.exchange(batch, generator)


@final
class DrawnSources(AbstractAugmentation):
    """Source views as somebody would draw them, with the small contradictions of views drawn one by one.

    Rays and points stay as captured, and so does the hull: what the drawings get wrong is to be averaged out, not learned.

    Args:
        drawing_share: Share of the characters whose source views are drawn.
        wobble: Largest displacement by the unsteady hand, as a share of the picture's side.
        shift: Largest offset of a view against the others, as a share of the side.
        scale: Largest relative difference in size of a view.
    """

    def __init__(self, *, drawing_share: float, wobble: float, shift: float, scale: float) -> None:
        self.drawing_share = drawing_share
        self.mistakes = {"wobble": wobble, "shift": shift, "scale": scale}

    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch with its source views drawn at random."""
        images = batch.views.images
        drawn = [
            draw_pictures(one, random_style(generator, **self.mistakes), generator)
            if float(torch.rand((), generator=generator)) < self.drawing_share
            else one
            for one in images
        ]
        return replace(batch, views=replace(batch.views, images=torch.stack(drawn)))


@final
class StretchRecolorAndDraw(AbstractAugmentation):
    """Other proportions and colours, and source views drawn.

    Args:
        stretch_share: See StretchAndRecolor, as the next three.
        width_range: Factors on the width.
        depth_range: Factors on the depth.
        mirror_share: Share of the steps whose characters change left and right.
        recolor_share: Share of the steps whose colour channels are permuted.
        drawing_share: See DrawnSources, as the next three.
        wobble: Of the hand, as a share of the side.
        shift: Of a view, as a share of the side.
        scale: Of a view.
        used_views: The model's rule from drawings to views; a hull has maps for all of those.
    """

    def __init__(
        self,
        *,
        stretch_share: float,
        width_range: list[float],
        depth_range: list[float],
        mirror_share: float,
        recolor_share: float,
        drawing_share: float,
        wobble: float,
        shift: float,
        scale: float,
        used_views: Callable[[SourceViews], SourceViews],
    ) -> None:
        self.change = StretchAndRecolor(
            stretch_share=stretch_share,
            width_range=width_range,
            depth_range=depth_range,
            mirror_share=mirror_share,
            recolor_share=recolor_share,
            used_views=used_views,
        )
        self.draw = DrawnSources(drawing_share=drawing_share, wobble=wobble, shift=shift, scale=scale)

    def __call__(self, batch: TrainBatch, generator: torch.Generator) -> TrainBatch:
        """Return the batch changed, then drawn."""
        return self.draw(self.change(batch, generator), generator)


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
    pose = cameras.world_from_camera.clone()
    pose[..., :3, 3] = pose[..., :3, 3] * scales
    return replace(views, images=images, cameras=replace(cameras, world_from_camera=pose))


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


def recolor(batch: TrainBatch, order: Tensor) -> TrainBatch:
    """Permute the colour channels of drawings and targets alike."""
    images = torch.cat((batch.views.images[:, :, order], batch.views.images[:, :, 3:]), dim=2)
    surface = batch.surface
    return replace(
        batch,
        views=replace(batch.views, images=images),
        rgb=batch.rgb[..., order],
        surface=None if surface is None else replace(surface, rgb=surface.rgb[..., order]),
    )
