"""A character as its own mirror image: densities averaged over left and right."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from charnerf.geometry.bounds import Bounds
from charnerf.scene import AbstractField, DensityOutput, Scene
from charnerf.types import FieldOutput, Hull, TensorRecord
from charnerf.volume.marching import densities_inside

OTHER_SIDE = 0.01  # weight of the mirrored side's colour: it counts only where the own side is empty


def symmetric_scene(scene: Scene) -> Scene:
    """The scene whose density is the mean of a scene's density and its mirror image in x.

    Colours stay those of the point's own side, so that a badge stays where it is; where that side is empty the
    other one's are taken. Only for characters that are symmetric: of a sword in one hand, two of half the
    density would remain.

    Args:
        scene: One character's field.

    Returns:
        A scene of one field, whose hull is the union of the hull and its mirror image (or a little more).
    """
    return Scene(SymmetricField(scene), None, _symmetric_bounds(scene.bounds))


@dataclass(frozen=True)
class _Points(TensorRecord):
    """Points (P, 3) and directions (P, 3) whose colours may be wanted."""

    points: Tensor
    view_dirs: Tensor


@final
@dataclass(frozen=True)
class SymmetricField(AbstractField):
    """Density of both sides of a scene's finest field, colours of the own one."""

    scene: Scene

    @property
    def sees_directions(self) -> bool:
        """As the field's."""
        return self.scene.field.sees_directions

    @property
    def bytes_per_point(self) -> int:
        """As the field's."""
        return self.scene.field.bytes_per_point

    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """Colours (P, 3) and densities (P,)."""
        own, other = self._inside(points, view_dirs), self._inside(*mirrored(points, view_dirs))
        tiny = torch.finfo(points.dtype).tiny
        weight = own.densities + tiny
        share = (weight / (weight + OTHER_SIDE * other.densities))[:, None]
        return FieldOutput(
            rgb=share * own.rgb + (1.0 - share) * other.rgb, densities=0.5 * (own.densities + other.densities)
        )

    def densities(self, points: Tensor, view_dirs: Tensor) -> DensityOutput:
        """Densities (P,); colours are asked for by point."""
        field, bounds = self.scene.field, self.scene.bounds
        own, other = (
            densities_inside(field, p, d, bounds.may_hold(p))
            for p, d in ((points, view_dirs), mirrored(points, view_dirs))
        )
        return DensityOutput(0.5 * (own + other), _Points(points, view_dirs))

    def colors(self, state: _Points) -> Tensor:
        """Colours (Q, 3)."""
        return self(state.points, state.view_dirs).rgb

    def lattice(self, low: Tensor, high: Tensor) -> tuple[Tensor, float]:
        """As the field's."""
        return self.scene.field.lattice(low, high)

    def at_width(self, width: int) -> AbstractField:
        """Colours from drawings so many pixels wide."""
        return SymmetricField(self.scene.at_width(width))

    def _inside(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """The field's answers inside of its own bounds, grey and empty outside."""
        index = self.scene.bounds.may_hold(points).nonzero()[:, 0]
        answer = self.scene.field(points[index], view_dirs[index])
        rgb = torch.full_like(points, 0.5).index_copy(0, index, answer.rgb)
        return FieldOutput(rgb, points.new_zeros(len(points)).index_copy(0, index, answer.densities))


def mirrored(points: Tensor, view_dirs: Tensor) -> tuple[Tensor, Tensor]:
    """Points and directions (P, 3) seen in the mirror x = 0."""
    flip = points.new_tensor((-1.0, 1.0, 1.0))
    return points * flip, view_dirs * flip


def _symmetric_bounds(bounds: Bounds) -> Bounds:
    hull, outlines = bounds.hull, bounds.outlines
    return replace(
        bounds,
        hull=None if hull is None else symmetric_hull(hull),
        outlines=None
        if outlines is None
        else lambda points: outlines(points) | outlines(mirrored(points, points)[0]),
    )


def symmetric_hull(hull: Hull) -> Hull:
    """A hull that contains one character's hull (no B axis) and its mirror image, on a box symmetric in x.

    Its cells are at least as wide as the hull's, and each counts where it touches an occupied one or the mirror
    image of one. The maps of the views stay as they are.
    """
    num = hull.occupancy.shape[0]
    low, high = float(hull.box_min[0]), float(hull.box_max[0])
    half, cell = max(abs(low), abs(high)), (high - low) / num
    edges = torch.linspace(-half, half, num + 1, dtype=torch.float64)
    first = ((edges[:-1] - low) / cell - 1e-6).floor().long()
    last = ((edges[1:] - low) / cell + 1e-6).ceil().long() - 1
    occupancy = torch.zeros_like(hull.occupancy)
    for index in range(num):
        begin, end = max(int(first[index]), 0), min(int(last[index]), num - 1)
        if begin <= end:
            occupancy[index] = hull.occupancy[begin : end + 1].any(0)
    box_min, box_max = hull.box_min.clone(), hull.box_max.clone()
    box_min[0], box_max[0] = -half, half
    return replace(hull, occupancy=occupancy | occupancy.flip(0), box_min=box_min, box_max=box_max)
