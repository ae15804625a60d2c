"""The same views with other numbers of pixels."""

from dataclasses import replace

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.types import Cameras, SourceViews


def resized_cameras(cameras: Cameras, width: int, height: int) -> Cameras:
    """Cameras that see the same with width x height pixels."""
    factors = cameras.focal.new_tensor((width / cameras.width, height / cameras.height))
    return replace(
        cameras,
        focal=cameras.focal * factors,
        principal_point=cameras.principal_point * factors,
        width=width,
        height=height,
    )


def resized_pictures(pictures: Tensor, width: int, height: int) -> Tensor:
    """Pictures (N, C, H, W) with width x height pixels; premultiply alpha before.

    Whole blocks of pixels are averaged, which is how captures are antialiased; other ratios are bilinear, antialiased.
    """
    if pictures.shape[-1] % width == 0 and pictures.shape[-2] % height == 0:
        return F.interpolate(pictures, size=(height, width), mode="area")
    return F.interpolate(pictures, size=(height, width), mode="bilinear", antialias=True)


def resized_views(views: SourceViews, width: int) -> SourceViews:
    """Views (B, V) so many pixels wide, in their proportions, with their cameras; colours are weighted by alpha."""
    height = round(views.cameras.height * width / views.cameras.width)
    rgb, alpha = views.images[:, :, :3], views.images[:, :, 3:]
    flat = resized_pictures(torch.cat((rgb * alpha, alpha), dim=2).flatten(0, 1), width, height).clamp(
        0.0, 1.0
    )
    straight = (flat[:, :3] / flat[:, 3:].clamp_min(1e-6)).clamp(0.0, 1.0)
    images = torch.cat((straight, flat[:, 3:]), dim=1).unflatten(0, views.present.shape)
    widened = views.widened_alphas
    if widened is not None:
        widened = resized_pictures(widened, width, height).clamp(0.0, 1.0)
    cameras = resized_cameras(views.cameras, width, height)
    return replace(views, images=images, cameras=cameras, widened_alphas=widened)
