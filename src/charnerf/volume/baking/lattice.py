"""The lattice that a character is baked on, and what light reaches on it.

Letters: X, Y, Z points along the axes, one cell less each; P points.
"""

from dataclasses import dataclass

import torch
from scipy import ndimage
from torch import Tensor
from torch.nn import functional as F

from charnerf.scene import Scene

MOST_STEPS = 96  # of light into thin haze; more would find little more that is dark


@dataclass(frozen=True)
class Lattice:
    """Points at origin + pitch * index, index from 0 to shape - 1, around all that a scene may hold.

    Attributes:
        origin: (3,), m.
        pitch: m.
        shape: X, Y, Z.
    """

    origin: Tensor
    pitch: float
    shape: tuple[int, int, int]

    @classmethod
    def of(cls, scene: Scene, coarser: int = 1) -> "Lattice":
        """The one that a scene's finest field is smoothest between, its pitch some times as long."""
        low, high = scene.bounds.tight_box
        through, pitch = scene.field.lattice(low, high)
        pitch *= coarser
        first = ((low - through) / pitch).floor() - 1.0
        x, y, z = (((high - through) / pitch).ceil() + 2.0 - first).int().tolist()
        return cls(through + first * pitch, pitch, (x, y, z))

    def points(self, index: Tensor, factor: int = 1) -> Tensor:
        """Positions (P, 3), m, of points by index (P, 3), of the lattice divided by a factor."""
        return self.origin + index * (self.pitch / factor)

    def held(self, scene: Scene) -> Tensor:
        """Which of its points may hold something, (X, Y, Z) bool."""
        held = torch.zeros(self.shape, dtype=torch.bool, device=self.origin.device)
        layer = torch.ones_like(held[0]).nonzero()
        for x in range(self.shape[0]):
            index = torch.cat((torch.full_like(layer[:, :1], x), layer), dim=-1)
            held[x] = scene.bounds.may_hold(self.points(index)).view(held[x].shape)
        return held


def light_depths(densities: Tensor, pitch: float) -> Tensor:
    """Optical depth that light has behind it at least when it comes near points (X, Y, Z).

    Along the best path over the 26 neighbours, each step as long as the pitch and as thin as the thinnest point around it: no
    straight ray has less behind it, so that what is dark here is dark in every picture.

    Args:
        densities: Of the points, (X, Y, Z), 1/m; nothing lies beyond them.
        pitch: m.
    """
    steps = pitch * -largest_around(-densities)
    depths = torch.where(densities > 0.0, torch.inf, 0.0)
    for _ in range(MOST_STEPS):
        before = depths
        depths = torch.minimum(depths, steps - largest_around(-depths))
        if torch.equal(depths, before):
            break
    return -largest_around(-depths)


def largest_around(values: Tensor) -> Tensor:
    """Largest of the values (X, Y, Z) of the 27 points around each, 0 beyond the border."""
    for axis in range(3):
        padding = [0] * 6
        padding[4 - 2 * axis] = padding[5 - 2 * axis] = 1
        padded, size = F.pad(values, padding), values.shape[axis]
        beside = torch.maximum(padded.narrow(axis, 0, size), padded.narrow(axis, 2, size))
        values = torch.maximum(values, beside)
    return values


def any_corner(points: Tensor) -> Tensor:
    """Which cells (X - 1, Y - 1, Z - 1) have a corner among points (X, Y, Z), bool."""
    for axis in range(3):
        size = points.shape[axis] - 1
        points = points.narrow(axis, 0, size) | points.narrow(axis, 1, size)
    return points


def corners_of(cells: Tensor) -> Tensor:
    """Which points (X, Y, Z) are corners of cells (X - 1, Y - 1, Z - 1), bool."""
    return any_corner(F.pad(cells, [1] * 6))


def finer_points(cells: Tensor, factor: int) -> Tensor:
    """Which points of a lattice `factor` times as fine lie in cells (X - 1, Y - 1, Z - 1), their borders included, bool."""
    for axis in range(3):
        cells = cells.repeat_interleave(factor, dim=axis)
    return corners_of(cells)


def gaps(holding: Tensor) -> Tensor:
    """Cells from each of (X - 1, Y - 1, Z - 1) to the next one that holds something, along the axis where it is farthest, uint8."""
    if not bool(holding.any()):
        return torch.full_like(holding, 255, dtype=torch.uint8)
    distance = ndimage.distance_transform_cdt(~holding.cpu().numpy(), metric="chessboard")
    return torch.from_numpy(distance.clip(0, 255).astype("uint8")).to(holding.device)
