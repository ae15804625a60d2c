"""One character as renderers and mesh extraction see it: radiance fields and where they may hold something.

Letters: P points, Q some of them.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import torch
from torch import Tensor

from charnerf.geometry.bounds import Bounds
from charnerf.types import FieldOutput, TensorRecord

LATTICE_CELLS = 128  # along the longest side of a box, where a field has no lattice of its own


@dataclass(frozen=True)
class DensityOutput:
    """Densities now, colours on demand.

    Attributes:
        densities: (P,), 1/m.
        state: What colours of the points (P) are made of by the field's `colors`; parts of it are taken by index, parts of
            several answers of one field are joined.
    """

    densities: Tensor
    state: TensorRecord


class AbstractColoring(ABC):
    """Makes colours of what a field says about a place; no network takes part."""

    @abstractmethod
    def rgb_of(self, points: Tensor, appearance: Tensor) -> Tensor:
        """Colours (3, ..., P) of points (P, 3) of appearances (C, ..., P)."""

    @abstractmethod
    def at_width(self, width: int) -> "AbstractColoring":
        """By drawings so many pixels wide, for large pictures; itself where there are none."""


class AbstractField(ABC):
    """A radiance field: answers points (P, 3), m, seen along unit directions (P, 3), zero for "no direction"."""

    @property
    @abstractmethod
    def sees_directions(self) -> bool:
        """Whether densities depend on the query direction."""

    @property
    def bytes_per_point(self) -> int:
        """Memory that it takes for a point while it answers; chunks are bounded by it."""
        return 16_384

    @abstractmethod
    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """Colours (P, 3) and densities (P,)."""

    def densities(self, points: Tensor, view_dirs: Tensor) -> DensityOutput:
        """Densities (P,), and what `colors` makes colours of: the answer in two steps; in one, where a field has but one."""
        answer = self(points, view_dirs)
        return DensityOutput(answer.densities, answer)

    def colors(self, state: Any) -> Tensor:
        """Colours (Q, 3) of (a part of) the state of a `DensityOutput`."""
        rgb: Tensor = state.rgb
        return rgb

    def lattice(self, low: Tensor, high: Tensor) -> tuple[Tensor, float]:
        """A point (3,), m, and the pitch, m, of the lattice that the field is smoothest on, for a box from low to high (3,)."""
        return low, float((high - low).amax()) / LATTICE_CELLS

    def uncut_densities(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Densities (P,), 1/m, without a direction, before drawings cut them, and the share (P,) that these leave, above 1 all."""
        densities = self.densities(points, torch.zeros_like(points)).densities
        return densities, torch.ones_like(densities)

    @property
    def coloring(self) -> "AbstractColoring | None":
        """How colours are made of an appearance; None where the field answers with colours alone."""
        return None

    def appearance(self, points: Tensor, view_dirs: Tensor) -> Tensor:
        """What `coloring` makes colours of, (P, K, C), of points (P, 3) each seen along directions (K, 3).

        It changes more slowly from point to point than colours, which may be read from pictures.
        """
        raise NotImplementedError(f"{type(self).__name__} has no coloring.")

    def at_width(self, width: int) -> "AbstractField":
        """The field with its colours read from drawings so many pixels wide, for large pictures; itself where there are none."""
        return self


@final
@dataclass(frozen=True)
class FunctionField(AbstractField):
    """A field by a function of points and directions, such as a formula."""

    function: Callable[[Tensor, Tensor], FieldOutput]
    sees_directions: bool = False
    bytes_per_point: int = 16_384

    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """What the function answers."""
        return self.function(points, view_dirs)


@final
@dataclass(frozen=True)
class Scene:
    """One character: its fields, and where they may hold something.

    Attributes:
        coarse: Field of the coarse pass.
        fine: Field of the fine pass, None where the model has none.
        bounds: Outside of them the density is zero.
    """

    coarse: AbstractField
    fine: AbstractField | None
    bounds: Bounds

    @property
    def field(self) -> AbstractField:
        """The finest field there is."""
        return self.coarse if self.fine is None else self.fine

    def at_width(self, width: int) -> "Scene":
        """The scene with its colours read from drawings so many pixels wide; as it is where there are none."""
        fine = None if self.fine is None else self.fine.at_width(width)
        return Scene(self.coarse.at_width(width), fine, self.bounds)
