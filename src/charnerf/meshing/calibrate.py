"""The density at which a field's surface lies, chosen by silhouettes instead of by a magic number.

A surface drawn at too low a density takes in haze, at too high a density it loses hands and feet. What
decides is what volume rendering of the same densities shows: seen from around, the surface should have the
silhouettes of the rendered opacity, and seen from the drawings those of their masks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from charnerf.errors import NumericalError
from charnerf.geometry.cameras import cameras_towards, direction_from_angles, pixel_centres, pixel_rays
from charnerf.geometry.rays import box_interval, points_along
from charnerf.meshing.density_grid import DensityGrid
from charnerf.types import Cameras, RayBundle, SourceViews

LEVELS = tuple(float(x) for x in np.round(np.geomspace(2.0, 400.0, 24), 3))  # 1/m
MIDDLE_LEVEL = 20.0  # 1/m
AROUND = 12  # cameras around the character
PICTURE = 96  # pixels a side of their pictures
RENDERED_ALPHA = 0.5  # a rendered pixel belongs to the silhouette from this opacity on
MASK_ALPHA = 0.5


@dataclass(frozen=True)
class LevelChoice:
    """The chosen level and its evidence.

    Attributes:
        level: Density, 1/m.
        iou: Agreement of silhouettes at the level, mean of the two below where both exist.
        tried: For each level tried (level, IoU with rendered opacity, IoU with the drawings' masks or NaN).
    """

    level: float
    iou: float
    tried: tuple[tuple[float, float, float], ...]


@torch.no_grad()
def choose_level(grid: DensityGrid, views: SourceViews | None) -> LevelChoice:
    """Choose the density whose surface has the silhouettes that rendering and the drawings show.

    Args:
        grid: Densities.
        views: The drawings (B = 1), or None where there are none.

    Raises:
        NumericalError: If the grid is empty at all levels.
    """
    volume = torch.from_numpy(np.ascontiguousarray(grid.densities))
    corner = torch.from_numpy(grid.origin).float()
    extent = torch.tensor([n - 1 for n in grid.densities.shape]) * grid.spacing
    centre = corner + 0.5 * extent
    half = float(0.5 * extent.norm())
    angles = torch.arange(AROUND) * (360.0 / AROUND) + 15.0
    around = cameras_towards(
        direction_from_angles(angles, torch.full_like(angles, 15.0)),
        target=centre, distance=half + 4.0, half_extent=half, size=PICTURE, orthographic=True,
    )  # fmt: skip
    rendered = [_march(grid, volume, around[i]) for i in range(AROUND)]
    drawn = []
    if views is not None:
        for v in (views.present[0] & ~views.mirrored[0]).nonzero()[:, 0].tolist():
            stride = max(1, -(-views.images.shape[-1] // 160))
            peak, _ = _march(grid, volume, views.cameras[0, v].to("cpu"), stride)
            drawn.append(
                (peak, views.images[0, v, 3, stride // 2 :: stride, stride // 2 :: stride].cpu() > MASK_ALPHA)
            )
    tried = []
    for level in LEVELS:
        ious = [_iou(peak > level, opacity > RENDERED_ALPHA) for peak, opacity in rendered]
        masks = [_iou(peak > level, mask) for peak, mask in drawn]
        tried.append((level, float(np.mean(ious)), float(np.mean(masks)) if masks else float("nan")))
    scores = [np.nanmean(row[1:]) for row in tried]
    best = int(np.argmax(scores))
    if not scores[best] > 0:
        low, high = float(grid.densities.min()), float(grid.densities.max())
        raise NumericalError(
            f"density grid: found densities from {low:.3g} to {high:.3g} 1/m, expected an opaque figure: no "
            "level from "
            f"{LEVELS[0]:g} to {LEVELS[-1]:g} 1/m shows a silhouette. The field is empty: train longer, or "
            "check the drawings' masks."
        )
    return LevelChoice(level=LEVELS[best], iou=float(scores[best]), tried=tuple(tried))


def _march(grid: DensityGrid, volume: Tensor, camera: Cameras, stride: int = 1) -> tuple[Tensor, Tensor]:
    """Greatest density on each pixel's ray and the opacity of the ray, (h, w) each."""
    pixels = pixel_centres(camera.width, camera.height)[stride // 2 :: stride, stride // 2 :: stride]
    rays = pixel_rays(camera, pixels.reshape(-1, 2).to(camera.focal.dtype))
    rays = RayBundle(rays.origins.float(), rays.directions.float())
    corner = torch.from_numpy(grid.origin).float()
    extent = torch.tensor([n - 1 for n in volume.shape]) * grid.spacing
    near, far = box_interval(rays, corner, corner + extent)
    volume_contrast = volume / (volume + MIDDLE_LEVEL)  # interpolated as the surface is, nearly
    hit = (far > near).nonzero()[:, 0]
    peak, opacity = torch.zeros(len(near)), torch.zeros(len(near))
    num = int(1.5 * max(volume.shape))
    middle = (torch.arange(num) + 0.5) / num
    for part in hit.split(4096):
        length = far[part] - near[part]
        points = points_along(rays[part], near[part, None] + length[:, None] * middle)
        at = 2.0 * (points - corner) / extent - 1.0
        # grid_sample takes the last axis of the volume first
        read = grid_sample(volume[None, None], at.flip(-1)[None, None], align_corners=True)[0, 0, 0]
        contrast = grid_sample(volume_contrast[None, None], at.flip(-1)[None, None], align_corners=True)[
            0, 0, 0
        ]
        share = contrast.amax(-1).clamp(0.0, 1.0 - 1e-6)
        peak[part] = MIDDLE_LEVEL * share / (1.0 - share)
        opacity[part] = -torch.expm1(-read.sum(-1) * length / num)
    return peak.reshape(pixels.shape[:2]), opacity.reshape(pixels.shape[:2])


def _iou(first: Tensor, second: Tensor) -> float:
    union = int((first | second).sum())
    return int((first & second).sum()) / union if union else 0.0
