"""Where a character may have a density: a box, its visual hull, the outlines of its drawings."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from charnerf.geometry.hull import hull_contains
from charnerf.geometry.occupied import coarse_occupancy
from charnerf.types import Hull


@dataclass(frozen=True)
class Bounds:
    """Outside of these the density is zero by definition and need not be evaluated.

    Attributes:
        box_min: Lower corner of the space looked at, (3,), m.
        box_max: Upper corner, (3,), m.
        hull: The character's hull (no B axis), None for a model without.
        outlines: Which points (P, 3) every drawing that carves shows something of, (P,) bool: beside them the density is
            zero, in the hull too. None where it is not.
    """

    box_min: Tensor
    box_max: Tensor
    hull: Hull | None = None
    outlines: Callable[[Tensor], Tensor] | None = None

    @property
    def tight_box(self) -> tuple[Tensor, Tensor]:
        """Corners of the hull's box, of the space looked at where there is no hull, (3,) each, m."""
        return (self.box_min, self.box_max) if self.hull is None else (self.hull.box_min, self.hull.box_max)

    @cached_property
    def coarse_hull(self) -> Tensor | None:
        """The hull's occupancy pooled and dilated (see geometry/occupied.py), for those who look there first."""
        return None if self.hull is None else coarse_occupancy(self.hull.occupancy)

    def may_hold(self, points: Tensor) -> Tensor:
        """Whether there may be a density at points (..., 3), (...) bool."""
        if self.hull is None:
            held = torch.ones_like(points[..., 0], dtype=torch.bool)
        else:
            held = hull_contains(self.hull, points)
        if self.outlines is not None:
            index = held.nonzero(as_tuple=True)
            held[index] = self.outlines(points[index])
        return held
