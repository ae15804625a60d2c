"""Pixel-aligned lookup: reading maps at projected points.

Maps are kept as rows, one per pixel, and read by a weighted sum of four rows: the same numbers as bilinear interpolation of an
image, at a fraction of its cost on a CPU, and linear maps of the features can be applied to the rows beforehand.
"""

import torch
from torch import Tensor

from charnerf.models.fused import read_bags


def bilinear_rows(pixels: Tensor, *, width: int, height: int) -> tuple[Tensor, Tensor]:
    """Which four pixels surround each position in each view's map, and their weights.

    Args:
        pixels: Positions in the map's own pixels, (P, V, 2), centres at +0.5; positions beyond the border read the border, and a
            position that is not finite reads pixel 0 (mask it).
        width: Of the map, pixels.
        height: Of the map, pixels.

    Returns:
        indices (P * V, 4) into rows ordered (V, height, width), and weights (P * V, 4) that sum to 1.
    """
    num_views = pixels.shape[1]
    left, top, fx, fy = first_pixels(pixels, width=width, height=height)
    step_x, step_y = min(1, width - 1), width * min(1, height - 1)
    view_offset = torch.arange(num_views, device=pixels.device) * (width * height)
    corner = view_offset + top * width + left
    indices = torch.stack((corner, corner + step_x, corner + step_y, corner + step_y + step_x), dim=-1)
    weights = torch.stack(((1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy), dim=-1)
    return indices.reshape(-1, 4), weights.reshape(-1, 4)


def first_pixels(pixels: Tensor, *, width: int, height: int) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Column and row of the first of the four pixels around positions (..., 2), and how far on the positions lie, (...) each."""
    safe = torch.nan_to_num(pixels, nan=0.0, posinf=0.0, neginf=0.0)
    x = (safe[..., 0] - 0.5).clamp(0.0, width - 1.0)
    y = (safe[..., 1] - 0.5).clamp(0.0, height - 1.0)
    left, top = (
        x.detach().long().clamp_max(max(width - 2, 0)),
        y.detach().long().clamp_max(max(height - 2, 0)),
    )
    return left, top, x - left, y - top


def read_rows(rows: Tensor, indices: Tensor, weights: Tensor) -> Tensor:
    """Weighted sums of rows: rows (N, C), indices and weights (Q, 4) -> (Q, C)."""
    return read_bags(rows, indices, weights.to(rows.dtype))


def maps_to_rows(maps: Tensor) -> Tensor:
    """Maps (V, C, h, w) as rows (V * h * w, C)."""
    return maps.permute(0, 2, 3, 1).reshape(-1, maps.shape[1])
