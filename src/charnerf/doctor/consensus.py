"""What silhouettes agree on: the hull that they have in common, seen again by every camera.

Of right cameras the hull covers every silhouette. What is compared is to about five pixels of SIDE: silhouettes are widened by a
cell of the grid before, and the hull's cells are drawn as large after.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor
from torch.nn import functional as F

from charnerf.errors import DataError
from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.carving import GRID, INSIDE, figure_cells, spread
from charnerf.types import Cameras

COVERED = 0.99  # of every silhouette, where cameras are right
MOST_CARVING = 24
SLACK = 1  # pixel, beside a cell of the grid


@dataclass(frozen=True)
class Consensus:
    """A hull and how it looks.

    Attributes:
        points: Centres of its cells, (K, 3).
        cell: A cell's sides, (3,).
        shown: What cameras see of it, (N, S, S), bool.
        covered: Share of each silhouette that this covers, (N,).
    """

    points: Tensor
    cell: Tensor
    shown: Tensor
    covered: Tensor

    @property
    def agrees(self) -> bool:
        """Whether it covers all silhouettes."""
        return float(self.covered.min()) >= COVERED


def consensus(cameras: Cameras, alphas: Tensor, carving: Sequence[int]) -> Consensus | None:
    """The hull of some silhouettes seen by all cameras, None where they have no point in common.

    Args:
        cameras: (N,), in any world.
        alphas: (N, S, S), none empty.
        carving: The views whose silhouettes are carved from.
    """
    masks = alphas > INSIDE
    tallest = max(int(np.ptp(np.nonzero(mask.numpy())[0])) for mask in masks)
    radius = int(np.ceil(0.87 * tallest / GRID))  # pixels of half a cell's diagonal
    wide = _widened(masks, radius + SLACK).double()
    index = torch.tensor(list(carving))
    try:
        points, cell = figure_cells(cameras[index], wide[index])
    except DataError:
        return None
    shown = torch.stack([_drawn(cameras[view : view + 1], points, radius) for view in range(len(masks))])
    covered = (shown & masks).flatten(1).sum(1) / masks.flatten(1).sum(1)
    return Consensus(points, cell, shown, covered)


def carving_views(cameras: Cameras) -> list[int]:
    """A few views, evenly chosen; those that are orthographic, which drawings are, always."""
    every = torch.arange(len(cameras.orthographic))
    some = spread(every, MOST_CARVING).tolist()
    return sorted({*some, *cameras.orthographic.nonzero()[:, 0].tolist()})


def disagreeing(
    cameras: Cameras, alphas: Tensor, carving: Sequence[int]
) -> tuple[list[int], Consensus] | None:
    """The few views without which all others agree, and what these agree on; None where no few are to blame."""
    kept, out = list(carving), list[int]()
    while len(kept) > 3 and len(out) <= max(1, len(carving) // 8):
        left = {view: consensus(cameras, alphas, [one for one in kept if one != view]) for view in kept}
        there = {view: one for view, one in left.items() if one is not None}
        if not there:
            return None
        best = max(
            there, key=lambda view: float(there[view].covered[[one for one in kept if one != view]].mean())
        )
        kept.remove(best)
        out.append(best)
        agreed = there[best]
        if float(agreed.covered[kept].min()) >= COVERED:
            others = [view for view in range(len(alphas)) if float(agreed.covered[view]) < COVERED]
            return sorted({*out, *others}), agreed
    return None


def _widened(masks: Tensor, pixels: int) -> Tensor:
    return torch.stack([
        torch.from_numpy(ndimage.binary_dilation(mask.numpy(), iterations=pixels)) for mask in masks
    ])  # fmt: skip


def _drawn(camera: Cameras, points: Tensor, radius: int) -> Tensor:
    """Pixels (S, S) of a camera of shape (1,) that points (K, 3) fall on, widened by a radius."""
    pixels, _, in_front = project_into_all(camera.to(torch.float64), points)
    x, y = pixels[:, 0].floor().long().unbind(-1)
    held = in_front[:, 0] & (x >= 0) & (x < camera.width) & (y >= 0) & (y < camera.height)
    drawn = torch.zeros(1, 1, camera.height, camera.width)
    drawn[0, 0, y[held], x[held]] = 1.0
    return F.max_pool2d(drawn, 2 * radius + 1, stride=1, padding=radius)[0, 0] > 0.0
