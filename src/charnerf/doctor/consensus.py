"""What silhouettes agree on: the hull that they have in common, seen again by every camera.

Of right cameras the hull covers every silhouette. What is compared is to about five pixels of SIDE: silhouettes are widened by a
cell of the grid before, and the hull's cells are drawn as large after.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import binary_dilation, binary_erosion
from torch import Tensor
from torch.nn import functional as F

from charnerf.errors import DataError
from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.carving import GRID, INSIDE, figure_cells, spread
from charnerf.types import Cameras

COVERED = 0.99  # of every silhouette, where cameras are right
MOST_CARVING = 24
SLACK = 1  # pixel, beside a cell of the grid
FILLED = 0.95  # of what lies well inside the hull, by a right mask: without it the hull is larger


@dataclass(frozen=True)
class Consensus:
    """A hull and how it looks.

    Attributes:
        points: Centres of its cells, (K, 3).
        cell: A cell's sides, (3,).
        shown: What cameras see of it, (N, S, S), bool.
        covered: Share of each silhouette that this covers, (N,).
        radius: Pixels by which cells are drawn larger.
    """

    points: Tensor
    cell: Tensor
    shown: Tensor
    covered: Tensor
    radius: int

    @property
    def agrees(self) -> bool:
        """Whether it covers all silhouettes."""
        return float(self.covered.min()) >= COVERED

    def fits(self, view: int, mask: Tensor) -> bool:
        """Whether a mask (S, S) is what a view ought to show: covered, and covering what lies well inside."""
        within = binary_erosion(self.shown[view].numpy(), iterations=2 * self.radius + 2 * SLACK)
        wide = binary_dilation(mask.numpy(), iterations=self.radius)
        filled = float((within & wide).sum()) >= FILLED * float(within.sum())
        return filled and float((mask & self.shown[view]).sum()) >= COVERED * float(mask.sum())


def consensus(cameras: Cameras, alphas: Tensor, carving: Sequence[int]) -> Consensus | None:
    """The hull of some silhouettes seen by all cameras, None where they have no point in common.

    Args:
        cameras: (N,), in any world.
        alphas: (N, S, S), none empty.
        carving: The views whose silhouettes are carved from.
    """
    masks, index = alphas > INSIDE, torch.tensor(list(carving))
    radius = _cell_radius(masks)
    try:
        points, cell = figure_cells(cameras[index], _widened(masks[index], radius))
    except DataError:
        return None
    shown = torch.stack([_drawn(cameras[view : view + 1], points, radius) for view in range(len(masks))])
    covered = (shown & masks).flatten(1).sum(1) / masks.flatten(1).sum(1)
    return Consensus(points, cell, shown, covered, radius)


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
    while len(kept) > 3 and len(out) < max(2, len(carving) // 8):
        worst = _most_in_the_way(cameras, alphas, kept)
        if worst is None:
            return None
        kept.remove(worst)
        out.append(worst)
        agreed = consensus(cameras, alphas, kept)
        if agreed is not None and float(agreed.covered[kept].min()) >= COVERED:
            others = [view for view in range(len(alphas)) if float(agreed.covered[view]) < COVERED]
            return sorted({*others, *_guilty(cameras, alphas, kept, out)}), agreed
    return None


def _guilty(cameras: Cameras, alphas: Tensor, kept: list[int], out: list[int]) -> list[int]:
    """Those of the views left out with which the others do not agree."""
    if len(out) == 1:
        return out
    again = {view: consensus(cameras, alphas, [*kept, view]) for view in out}
    return [
        view
        for view, one in again.items()
        if one is None or float(one.covered[[*kept, view]].min()) < COVERED
    ]


def _most_in_the_way(cameras: Cameras, alphas: Tensor, kept: list[int]) -> int | None:
    """The view without which the others' hull covers the most of their silhouettes, None where there is no hull.

    One carving tells of all: its cells are those that no view or one alone leaves out, and without that one its cells are there.
    """
    index, masks = torch.tensor(kept), alphas[kept] > INSIDE
    cameras, radius = cameras[index].to(torch.float64), _cell_radius(masks)
    wide = _widened(masks, radius)
    try:
        points, _ = figure_cells(cameras, wide, misses=1)
    except DataError:
        return None
    pixels, _, in_front = project_into_all(cameras, points)
    x, y = pixels.floor().long().clamp(0, wide.shape[-1] - 1).unbind(-1)
    missed = ~(wide[torch.arange(len(kept)), y, x] > INSIDE) | ~in_front
    alone = missed.sum(1) == 1
    common = points[~missed.any(1)]
    covered = torch.zeros(len(kept), len(kept))  # of each view, without each one
    for view, mask in enumerate(masks):
        shown = _drawn(cameras[view : view + 1], common, radius)
        for one in range(len(kept)):
            more = _drawn(cameras[view : view + 1], points[alone & missed[:, one]], radius)
            covered[one, view] = float(((shown | more) & mask).sum() / mask.sum())
    covered.fill_diagonal_(0.0)
    return kept[int(covered.sum(1).argmax())]


def _cell_radius(masks: Tensor) -> int:
    """Pixels of half the diagonal of a cell, for the tallest silhouette."""
    tallest = max(int(np.ptp(np.nonzero(mask.numpy())[0])) for mask in masks)
    return int(np.ceil(0.87 * tallest / GRID))


def _widened(masks: Tensor, radius: int) -> Tensor:
    wide = [binary_dilation(mask.numpy(), iterations=radius + SLACK) for mask in masks]
    return torch.from_numpy(np.stack(wide)).double()


def _drawn(camera: Cameras, points: Tensor, radius: int) -> Tensor:
    """Pixels (S, S) of a camera of shape (1,) that points (K, 3) fall on, widened by a radius."""
    pixels, _, in_front = project_into_all(camera.to(torch.float64), points)
    x, y = pixels[:, 0].floor().long().unbind(-1)
    held = in_front[:, 0] & (x >= 0) & (x < camera.width) & (y >= 0) & (y < camera.height)
    drawn = torch.zeros(1, 1, camera.height, camera.width)
    drawn[0, 0, y[held], x[held]] = 1.0
    return F.max_pool2d(drawn, 2 * radius + 1, stride=1, padding=radius)[0, 0] > 0.0
