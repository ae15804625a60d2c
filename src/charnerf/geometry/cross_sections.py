"""Where a point lies in the hull's cross-section: between the two ends of the occupied run through it, along each world axis.

Silhouettes leave corners that no body has: seen from above, the hull of a round head is a square. Which points are such
corners can be said in proportions of the run, whatever its length, and from no single drawing.

Letters: G cells a side of the hull, g of the cross-sections' grid, P points.
"""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.types import Hull, TensorRecord

POOL = 2  # cells of the hull a side of a cell here


@dataclass(frozen=True)
class CrossSections(TensorRecord):
    """Runs of occupied cells through every cell.

    Attributes:
        grid: (7, g, g, g), indexed x, y, z: middles of the runs along the three axes, m; half of their lengths, m; occupancy. All
            zero in empty cells.
        box_min: (3,), m, lower corner of the grid.
        box_max: (3,), m, upper corner.
    """

    grid: Tensor
    box_min: Tensor
    box_max: Tensor


def cross_sections(hull: Hull) -> CrossSections:
    """Measure the runs of one character's hull.

    Args:
        hull: One character's, (no B axis).
    """
    occupied = _pooled(hull.occupancy)
    side = occupied.shape[-1]
    cell = (hull.box_max - hull.box_min) / side
    numbers = torch.arange(side, dtype=cell.dtype, device=occupied.device)
    grid = cell.new_zeros((7, side, side, side))
    grid[6] = inside = occupied.to(cell.dtype)
    for axis in range(3):
        number = numbers.view([-1 if a == axis else 1 for a in range(3)])
        before = torch.where(occupied, -1.0, number).cummax(axis).values
        after = torch.where(occupied, float(side), number).flip(axis).cummin(axis).values.flip(axis)
        middle = hull.box_min[axis] + 0.5 * (before + after + 1.0) * cell[axis]
        half = 0.5 * (after - before - 1.0) * cell[axis]
        torch.mul(middle, inside, out=grid[axis])
        torch.mul(half, inside, out=grid[axis + 3])
    return CrossSections(grid=grid, box_min=hull.box_min, box_max=hull.box_max)


def _pooled(occupancy: Tensor) -> Tensor:
    """Whether any cell (G, G, G) in one of the cross-sections' grid is occupied, (g, g, g) bool; each training step asks."""
    for axis in range(3):
        first, second = occupancy.unflatten(axis, (-1, POOL)).unbind(axis + 1)
        occupancy = first | second
    return occupancy


def read_cross_sections(sections: CrossSections, points: Tensor) -> tuple[Tensor, Tensor]:
    """Where points lie in the runs through them, between cells by the occupied ones around.

    Args:
        sections: One character's.
        points: (P, 3), m.

    Returns:
        Places (P, 3), -1 and 1 at the ends of the run, 0 in its middle, beyond outside of the hull; and half-lengths of the runs
        (P, 3), m. Both 0 where no cell around is occupied.
    """
    share = 2.0 * (points - sections.box_min) / (sections.box_max - sections.box_min) - 1.0
    read = F.grid_sample(
        sections.grid[None], share.flip(-1)[None, None, None], align_corners=False, padding_mode="zeros"
    )[0, :, 0, 0].T
    amount = read[:, 6:]
    inside = amount > 1e-3
    middles, halves = (read[:, i : i + 3] / amount.clamp_min(1e-3) for i in (0, 3))
    places = (points - middles) / halves.clamp_min(1e-6)
    return torch.where(inside, places.clamp(-2.0, 2.0), 0.0), torch.where(inside, halves, 0.0)
