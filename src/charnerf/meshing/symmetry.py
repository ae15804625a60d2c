"""A character as its own mirror image: densities averaged over left and right."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from charnerf.geometry.hull import may_hold
from charnerf.geometry.occupied import coarse_occupancy
from charnerf.meshing.density_grid import densities_inside
from charnerf.types import DensityAnswer, FieldFunction, FieldOutput, Hull, Scene, TensorRecord

OTHER_SIDE = 0.01  # weight of the mirrored side's colour: it counts only where the own side is empty


@dataclass(frozen=True)
class _Asked(TensorRecord):
    """Points (P, 3) and directions (P, 3) whose colours may be wanted."""

    points: Tensor
    view_dirs: Tensor


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

    def densities(points: Tensor, view_dirs: Tensor) -> DensityAnswer:
        both = [densities_inside(scene, p, d) for p, d in ((points, view_dirs), mirrored(points, view_dirs))]
        mean = 0.5 * (both[0] + both[1])
        return DensityAnswer(
            mean, _Asked(points, view_dirs), lambda asked: field(asked.points, asked.view_dirs).rgb
        )

    field = _symmetric_field(scene)
    hull = None if scene.hull is None else symmetric_hull(scene.hull)
    at_width, in_outlines = scene.at_width, scene.in_outlines
    return replace(
        scene,
        coarse=field,
        fine=None,
        hull=hull,
        densities_first=densities,
        coarse_hull=None if hull is None else coarse_occupancy(hull.occupancy),
        at_width=None if at_width is None else lambda width: symmetric_scene(at_width(width)),
        in_outlines=None
        if in_outlines is None
        else lambda points: in_outlines(points) | in_outlines(mirrored(points, points)[0]),
    )


def mirrored(points: Tensor, view_dirs: Tensor) -> tuple[Tensor, Tensor]:
    """Points and directions (P, 3) seen in the mirror x = 0."""
    flip = points.new_tensor((-1.0, 1.0, 1.0))
    return points * flip, view_dirs * flip


def _symmetric_field(scene: Scene) -> FieldFunction:
    """Density of both sides, colours of the own one."""

    def masked(points: Tensor, view_dirs: Tensor) -> FieldOutput:
        index = may_hold(scene, points).nonzero()[:, 0]
        found = scene.field(points[index], view_dirs[index])
        rgb = torch.full_like(points, 0.5).index_copy(0, index, found.rgb)
        return FieldOutput(rgb, points.new_zeros(len(points)).index_copy(0, index, found.densities))

    def field(points: Tensor, view_dirs: Tensor) -> FieldOutput:
        own, other = masked(points, view_dirs), masked(*mirrored(points, view_dirs))
        tiny = torch.finfo(points.dtype).tiny
        weight = own.densities + tiny
        share = (weight / (weight + OTHER_SIDE * other.densities))[:, None]
        return FieldOutput(
            rgb=share * own.rgb + (1.0 - share) * other.rgb, densities=0.5 * (own.densities + other.densities)
        )

    return field


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
