"""A character that was baked, as a field: answers by its grid, and by the field that it was baked from where that is not enough.

Letters: P points, Q some of them.
"""

from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from charnerf.scene import AbstractColoring, AbstractField, DensityOutput
from charnerf.types import FieldOutput, TensorRecord
from charnerf.volume.baking.bake import Baked
from charnerf.volume.baking.directions import polynomials
from charnerf.volume.baking.grid import BakedGrid
from charnerf.volume.marching import points_at_once

AT_ONCE = 16_384  # colours; more leave the caches


@dataclass(frozen=True)
class _Places(TensorRecord):
    """Points (P, 3) and the directions (P, 3) that they are seen along."""

    points: Tensor
    view_dirs: Tensor


@final
@dataclass(frozen=True)
class BakedField(AbstractField):
    """A grid, and how its colours are made.

    Attributes:
        baked: The grid, and what it took.
        paint: How colours are made of the appearances in it; None where the source tells all of them.
        source: What it was baked from; None of one that was read from a file.
    """

    baked: Baked
    paint: AbstractColoring | None
    source: AbstractField | None

    @property
    def grid(self) -> BakedGrid:
        """The grid."""
        return self.baked.grid

    @property
    def coloring(self) -> AbstractColoring | None:
        """Of the appearances in the grid."""
        return self.paint

    @property
    def sees_directions(self) -> bool:
        """Densities do not: others are not baked."""
        return False

    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """Colours (P, 3) and densities (P,) by the grid."""
        return FieldOutput(self.colors_at(points, view_dirs)[0], self.grid.densities_at(points))

    def densities(self, points: Tensor, view_dirs: Tensor) -> DensityOutput:
        """Densities (P,)."""
        return DensityOutput(self.grid.densities_at(points), _Places(points, view_dirs))

    def colors(self, state: _Places) -> Tensor:
        """Colours (Q, 3)."""
        return self.colors_at(state.points, state.view_dirs)[0]

    def colors_at(self, points: Tensor, view_dirs: Tensor) -> tuple[Tensor, Tensor]:
        """Colours (P, 3), and their estimated errors (P,)."""
        if self.paint is None or not self.grid.has_colors:
            return self.exact_colors(points, view_dirs), torch.zeros_like(points[:, 0])
        rgb, errors = [points.new_zeros(0, 3)], [points.new_zeros(0)]
        for some, along in zip(points.split(AT_ONCE), view_dirs.split(AT_ONCE), strict=True):
            at = (some - self.grid.origin) / self.grid.pitch
            appearance, error = self.grid.read_colors(at, polynomials(along))
            rgb.append(self.paint.rgb_of(some, appearance.t().contiguous()).t())
            errors.append(error)
        return torch.cat(rgb), torch.cat(errors)

    def exact_colors(self, points: Tensor, view_dirs: Tensor) -> Tensor:
        """Colours (P, 3) by the source."""
        assert self.source is not None  # a file has colours
        size = points_at_once(self.source)
        pieces = zip(points.split(size), view_dirs.split(size), strict=True)
        return torch.cat([points.new_zeros(0, 3), *(self.source(at, along).rgb for at, along in pieces)])

    def at_width(self, width: int) -> "BakedField":
        """The same grid with colours from drawings so many pixels wide."""
        if self.source is None:
            return replace(self, paint=None if self.paint is None else self.paint.at_width(width))
        source = self.source.at_width(width)
        return replace(self, paint=source.coloring, source=source)
