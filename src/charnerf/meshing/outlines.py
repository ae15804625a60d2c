"""Parts that a drawing shows and a surface of one level misses: densities raised until the surface covers the drawings' outlines.

Where a field does not know at which depth an ear lies, it spreads a thin density over all depths that it may have: seen through,
dense enough; nowhere as dense as the surface of a chest. A drawing says that something is there. Along each of its rays that
shows the figure and meets no surface, densities are multiplied until the densest place does: the likeliest depth.

Letters: R rays, S samples on each.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.geometry.cameras import pixel_rays, project_into_all
from charnerf.geometry.rays import box_interval, points_along
from charnerf.meshing.density_grid import DensityGrid
from charnerf.scene import Scene
from charnerf.types import Cameras, SourceViews
from charnerf.volume.marching import densities_inside

MASK_ALPHA = 0.5
ABOVE = 1.1  # of the level: where the densest place of a ray is brought to; what is 0.91 times as dense is inside then
MOST = 30.0  # times; what would need more is no part of the figure that the field knows of
SURE = 2.0  # of the level: a ray that is this dense on the coarse grid meets the surface and is not looked at again
STEP = 0.012  # m, between samples
LIKELY = 4  # places of a ray that are looked at first
RAYS_AT_ONCE = 2048


@dataclass(frozen=True)
class RaisedRays:
    """By how much densities are multiplied along the rays of one drawing.

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
def raised_rays(scene: Scene, views: SourceViews, level: float, coarse: DensityGrid) -> list[RaisedRays]:
    """Find the rays of drawings that show the figure and meet no surface, and what mends that.

    Args:
        scene: One character's field.
        views: Its drawings (B = 1); mirrored ones show nothing that was drawn.
        level: Density of the surface, 1/m.
        coarse: Densities of the same field: what is dense there needs no second look.

    Returns:
        One entry a drawing.
    """
    raised = []
    for v in (views.present[0] & ~views.mirrored[0]).nonzero()[:, 0].tolist():
        camera, alpha = views.cameras[0, v : v + 1], views.images[0, v, 3]
        mask = alpha > MASK_ALPHA
        peaks = torch.full_like(alpha, torch.inf)
        peaks[mask] = _peaks(scene, camera, mask, coarse, level)
        gains = (ABOVE * level / peaks.clamp_min(torch.finfo(peaks.dtype).tiny)).clamp_min(1.0)
        missed = int((peaks < level).sum())
        # a gain of its own for every pixel would leave stairs: the largest around, smoothed
        logs = torch.where(gains > MOST, 1.0, gains).log()[None, None]
        logs = F.avg_pool2d(F.max_pool2d(logs, 3, stride=1, padding=1), 3, stride=1, padding=1)
        raised.append(RaisedRays(camera, logs[0, 0].exp(), missed, int(mask.sum())))
    return raised


def _peaks(scene: Scene, camera: Cameras, mask: Tensor, coarse: DensityGrid, level: float) -> Tensor:
    """Largest density inside the hull along the rays of a mask's pixels (H, W), 1/m: where it is below what needs no gain.

    Elsewhere it is infinite, or that of the places that the coarse grid thinks densest: most rays are settled by those.
    """
    y, x = mask.nonzero().unbind(-1)
    rays = pixel_rays(camera[0], torch.stack((x + 0.5, y + 0.5), dim=-1).to(camera.focal.dtype))
    near, far = box_interval(rays, *scene.bounds.tight_box)
    if len(near) == 0:
        return near
    num = max(2, int(float((far - near).max()) / STEP))
    share = (torch.arange(num, dtype=near.dtype, device=near.device) + 0.5) / num
    coarse_density = coarse.interpolator(near.device)
    peaks = torch.full_like(near, torch.inf)
    for part in torch.arange(len(near), device=near.device).split(RAYS_AT_ONCE):
        t = near[part, None] + (far - near).clamp_min(0.0)[part, None] * share
        points = points_along(rays[part], t)
        expected = coarse_density(points)
        left = (expected.amax(-1) < SURE * level).nonzero()[:, 0]
        likely = expected[left].topk(min(LIKELY, num), dim=-1).indices
        for places in (likely, torch.arange(num, device=near.device).expand(len(left), -1)):
            asked = points[left].gather(1, places[: len(left), :, None].expand(-1, -1, 3))
            dirs = rays.directions[part[left], None].expand_as(asked)
            found = densities_inside(scene.field, asked, dirs, scene.bounds.may_hold(asked)).amax(-1)
            peaks[part[left]] = found
            left = left[found < ABOVE * level]
    return peaks


def gain_at(raised: list[RaisedRays], points: Tensor) -> Tensor:
    """By how much densities at points (P, 3) are multiplied, (P,): the largest gain where rays of several drawings meet."""
    most = points.new_ones(len(points))
    for one in raised:
        pixels = project_into_all(one.camera, points)[0][:, 0]
        size = pixels.new_tensor((one.camera.width, one.camera.height))
        at = (2.0 * pixels / size - 1.0)[None, None]
        gains = one.gains[None, None].to(points.dtype)
        read = F.grid_sample(gains, at, align_corners=False, padding_mode="border")
        most = torch.maximum(most, read[0, 0, 0])
    return most
