"""Parts that a drawing shows and a surface misses: optical depths raised until the surface covers the drawings' outlines.

Where a field does not know at which depth an ear lies, it spreads a thin density over all depths that it may have: seen through
from some side. A drawing says that something is there. Along each of its rays that shows the figure and meets no surface, depths
are multiplied until the deepest place is inside: the likeliest one.

Letters: R rays, S samples on each; X, Y, Z grid points along the axes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.rays import points_along
from charnerf.meshing.grid import Grid
from charnerf.types import Cameras, SourceViews

MASK_ALPHA = 0.5
ABOVE = 1.1  # of the surface's value: where the deepest place of a ray is brought to; what is 0.91 times as deep is inside then
MOST = 30.0  # times; what would need more is no part of the figure that the field knows of
STEP = 0.012  # m, between samples
RAYS_AT_ONCE = 2048
POINTS_AT_ONCE = 65536


@dataclass(frozen=True)
class RaisedRays:
    """By how much values are multiplied along the rays of one drawing.

    Attributes:
        camera: The drawing's, (1,).
        gains: (H, W), at least 1.
        num_missed: Pixels of the figure whose rays met no surface.
        num_pixels: Pixels of the figure.
    """

    camera: Cameras
    gains: Tensor
    num_missed: int
    num_pixels: int


@torch.no_grad()
def covering(grid: Grid, views: SourceViews, level: float) -> tuple[Grid, float]:
    """Raise values so that the surface covers the drawings.

    Args:
        grid: Optical depths.
        views: The drawings (B = 1); mirrored ones show nothing that was drawn.
        level: Value of the surface.

    Returns:
        The grid anew, and the share of the drawings' pixels of the figure that met no surface before.
    """
    raised = raised_rays(grid, views, level)
    missed = sum(one.num_missed for one in raised)
    if missed:
        index = np.argwhere(grid.values > 0.0)
        values = grid.values.copy()
        for start in range(0, len(index), POINTS_AT_ONCE):
            part = index[start : start + POINTS_AT_ONCE]
            points = torch.from_numpy((grid.origin + part * grid.spacing).astype(np.float32))
            values[tuple(part.T)] *= gain_at(raised, points).numpy()
        grid = replace(grid, values=values)
    return grid, missed / max(1, sum(one.num_pixels for one in raised))


def raised_rays(grid: Grid, views: SourceViews, level: float) -> list[RaisedRays]:
    """Find the rays of drawings that show the figure and meet no surface, and what mends that; one entry a drawing."""
    raised = []
    for v in (views.present[0] & ~views.mirrored[0]).nonzero()[:, 0].tolist():
        camera, alpha = views.cameras[0, v : v + 1].to("cpu"), views.images[0, v, 3].cpu()
        mask = alpha > MASK_ALPHA
        peaks = torch.full_like(alpha, torch.inf)
        peaks[mask] = _peaks(grid, camera, mask, level)
        gains = (ABOVE * level / peaks.clamp_min(torch.finfo(peaks.dtype).tiny)).clamp_min(1.0)
        missed = int((peaks < level).sum())
        # a gain of its own for every pixel would leave stairs: the largest around, smoothed
        logs = torch.where(gains > MOST, 1.0, gains).log()[None, None]
        logs = F.avg_pool2d(F.max_pool2d(logs, 3, stride=1, padding=1), 3, stride=1, padding=1)
        raised.append(RaisedRays(camera, logs[0, 0].exp(), missed, int(mask.sum())))
    return raised


def _peaks(grid: Grid, camera: Cameras, mask: Tensor, level: float) -> Tensor:
    """Largest value along the rays (R,) of a mask's pixels (H, W)."""
    y, x = mask.nonzero().unbind(-1)
    pixels = torch.stack((x + 0.5, y + 0.5), dim=-1).to(camera.focal.dtype)
    rays, near, far = grid.rays_through(camera[0], pixels)
    if len(near) == 0:
        return near
    num = max(2, int(float((far - near).max()) / STEP))
    share = (torch.arange(num, dtype=near.dtype) + 0.5) / num
    value_at = grid.interpolator(level)
    peaks = []
    for part in torch.arange(len(near)).split(RAYS_AT_ONCE):
        t = near[part, None] + (far - near).clamp_min(0.0)[part, None] * share
        peaks.append(value_at(points_along(rays[part], t)).amax(-1).to(near.dtype))
    return torch.cat(peaks)


def gain_at(raised: list[RaisedRays], points: Tensor) -> Tensor:
    """By how much values at points (P, 3) are multiplied, (P,): the largest gain where rays of several drawings meet."""
    most = points.new_ones(len(points))
    for one in raised:
        pixels = project_into_all(one.camera, points)[0][:, 0]
        size = pixels.new_tensor((one.camera.width, one.camera.height))
        at = (2.0 * pixels / size - 1.0)[None, None]
        gains = one.gains[None, None].to(points.dtype)
        read = F.grid_sample(gains, at, align_corners=False, padding_mode="border")
        most = torch.maximum(most, read[0, 0, 0])
    return most
