"""From a character's field to a grid of it: what may hold something and what light reaches is evaluated, and nothing else.

Letters: P points, K directions, C values that a colour is made of.
"""

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.scene import Scene
from charnerf.volume.baking.directions import (
    NUM_POLYNOMIALS,
    expected_error,
    polynomials,
    projection,
    sampled_directions,
)
from charnerf.volume.baking.grid import (
    EMPTY_U,
    OPAQUE_U,
    SCALE,
    BakedGrid,
    between,
    combined,
    cut_densities,
    interpolated,
    u_from_densities,
)
from charnerf.volume.baking.lattice import (
    Lattice,
    any_corner,
    corners_of,
    finer_points,
    gaps,
    light_depths,
)
from charnerf.volume.marching import points_at_once

OnShare = Callable[[float], object]

log = logging.getLogger(__name__)

FACTOR = 2  # steps of the fine grid in one of the lattice
UNSEEN_SHARE = 0.1  # of the tolerance: light that is followed no further
FAINT_SHARE = 0.1  # of the tolerance: opacity of a metre of what counts as empty
THIN_SHARE = 0.2  # of the tolerance: opacity of a cell that has no colours and is not refined
STRAIGHT_SHARE = 0.08  # of the tolerance: expected error of a step's opacity in a cell that is not refined
LEAST_POINTS = 16  # of the lattice along its longest side, however little memory there is
TYPICAL_VALUES = 8  # that a colour is made of, for the estimate of memory
COLOR_COST = 6  # times that of a density, in the usual case; for the share of the work that is done
LATTICE_PART = 0.1  # of all work, in the usual case


@dataclass(frozen=True)
class Baked:
    """A grid, and what it took.

    Attributes:
        grid: The grid.
        coarser: Times that its steps are as long as asked, so that it fits into its memory.
        num_densities: Points whose density was evaluated.
        num_colors: Points whose colours were evaluated, along some directions each.
        num_points: Points of the whole box, for comparison.
        seconds: Time it took.
    """

    grid: BakedGrid
    coarser: int
    num_densities: int
    num_colors: int
    num_points: int
    seconds: float


@torch.no_grad()
def bake(
    scene: Scene,
    *,
    tolerance: float,
    memory_mib: float,
    factor: int = FACTOR,
    on_share: OnShare = lambda share: None,
) -> Baked:
    """Evaluate a scene's finest field on a grid; its density must not see the direction.

    Args:
        scene: One character's field.
        tolerance: Error of a colour that pictures may have; decides what is too faint or too dark to be evaluated.
        memory_mib: What the grid may take, MiB: it is made coarser where it would take more, and that is logged.
        factor: Steps of the grid in one of the field's lattice.
        on_share: Called again and again with the share of the work that is done, in [0, 1]; what it raises ends the work.
    """
    start = time.perf_counter()
    coarse, coarser, asked = _fitting(scene, tolerance, memory_mib, factor, on_share)
    lattice = coarse.lattice
    on_points = _counter(on_share, LATTICE_PART, 1.0, coarse.num_left(factor))
    fine = _Fine.of(scene, coarse, factor, on_points)
    beyond = finer_points(any_corner(coarse.dark) & ~coarse.holding, factor) & ~fine.used
    color_index, color_rows = _colors(scene, coarse, on_points)
    low, high = scene.bounds.tight_box
    grid = BakedGrid(
        low=low,
        high=high,
        origin=lattice.origin,
        pitch=lattice.pitch,
        factor=factor,
        u=fine.u.masked_fill_(beyond, OPAQUE_U),
        kept=fine.kept.masked_fill_(beyond, 1.0).half(),
        errors=_of_cells(fine.errors, factor),
        color_index=color_index,
        color_rows=color_rows,
        gaps=gaps(coarse.holding),
    )
    on_share(1.0)
    return Baked(
        grid=grid,
        coarser=coarser,
        num_densities=asked + fine.num_evaluated,
        num_colors=len(color_rows) - 1,
        num_points=fine.u.numel(),
        seconds=time.perf_counter() - start,
    )


def _fitting(
    scene: Scene, tolerance: float, memory_mib: float, factor: int, on_share: OnShare
) -> tuple["_Coarse", int, int]:
    """A scene on the finest lattice whose grid fits into a memory, times that it is as coarse as the field's, and points asked."""
    coarser, asked = 1, 0
    while True:
        coarse = _Coarse.of(scene, tolerance, coarser, factor, on_share)
        asked += coarse.num_evaluated
        taken = coarse.mib(factor, scene.field.coloring is not None)
        if taken <= memory_mib or max(coarse.lattice.shape) <= LEAST_POINTS:
            return coarse, coarser, asked
        coarser += 1
        log.warning(
            "renderer=baked: a grid in steps of %.1f mm takes %.0f MiB, renderer.memory_mib=%.0f is less: made %d times as coarse.",
            1000.0 * coarse.lattice.pitch / factor,
            taken,
            memory_mib,
            coarser,
        )


@dataclass(frozen=True)
class _Coarse:
    """A scene on its lattice, and what is to be found out beyond that.

    Attributes:
        lattice: The lattice, X, Y, Z points.
        u: Of its points' densities before they are cut, (X, Y, Z).
        kept: The share of them that is left, (X, Y, Z).
        dark: Which points no light reaches, (X, Y, Z) bool.
        errors: Of densities halfway between the points, 1/m, expected, (X, Y, Z).
        holding: Which cells hold something that light reaches, (X - 1, Y - 1, Z - 1) bool.
        refined: Which of them hold so much that it is worth to be known better.
        bent: Which of these hold densities that lie so far off straight lines between the points that they are asked for.
        num_evaluated: Points that the field was asked for.
    """

    lattice: Lattice
    u: Tensor
    kept: Tensor
    dark: Tensor
    errors: Tensor
    holding: Tensor
    refined: Tensor
    bent: Tensor
    num_evaluated: int

    @classmethod
    def of(cls, scene: Scene, tolerance: float, coarser: int, factor: int, on_share: OnShare) -> "_Coarse":
        """Evaluate a scene on a lattice so many times as coarse as its field's own, to be divided by a factor."""
        lattice = Lattice.of(scene, coarser)
        around = corners_of(any_corner(lattice.held(scene)))
        u = lattice.origin.new_full(lattice.shape, EMPTY_U)
        kept = torch.zeros_like(u)
        points = lattice.points(around.nonzero())
        u[around], kept[around] = _asked(scene, points, _counter(on_share, 0.0, LATTICE_PART, len(points)))
        densities = cut_densities(u, kept)
        dark = light_depths(densities, lattice.pitch) > -math.log(UNSEEN_SHARE * tolerance)
        holding = any_corner(densities > FAINT_SHARE * tolerance) & any_corner(~dark)
        refined = holding & any_corner(densities > THIN_SHARE * tolerance / lattice.pitch)
        errors, step = _expected_errors(u, kept), lattice.pitch / factor
        bent = any_corner(errors * step * torch.exp(-densities * step) > STRAIGHT_SHARE * tolerance) & refined
        looked_into = holding & ~bent if factor > 1 else torch.zeros_like(holding)
        missed = _missed_opacities(scene, lattice, u, kept, looked_into, step)
        bent[looked_into] = missed > STRAIGHT_SHARE * tolerance
        num_evaluated = len(points) + len(missed)
        return cls(lattice, u, kept, dark, errors, holding, refined | bent, bent, num_evaluated)

    @property
    def densities(self) -> Tensor:
        """Of its points, (X, Y, Z), 1/m."""
        return cut_densities(self.u, self.kept)

    def num_left(self, factor: int) -> int:
        """Points of which densities are still to be asked for, about, and colours for what they cost."""
        return int(finer_points(self.bent, factor).sum()) + COLOR_COST * int(corners_of(self.refined).sum())

    def mib(self, factor: int, has_colors: bool) -> float:
        """What its grid takes, about, MiB."""
        colors = int(corners_of(self.refined).sum()) * NUM_POLYNOMIALS * TYPICAL_VALUES if has_colors else 0
        densities = self.u.numel() * (
            1.5 * factor**3 + 2.25
        )  # u and the share kept; colours' index, errors and gaps
        return 4.0 * (densities + colors) / 2**20


def _counter(on_share: OnShare, low: float, high: float, total: int) -> Callable[[int], None]:
    """What is called with numbers of points and tells the share of all work, which goes from low to high with their total."""
    done = 0

    def count(number: int) -> None:
        nonlocal done
        done += number
        on_share(low + (high - low) * min(1.0, done / max(1, total)))

    return count


def _asked(scene: Scene, points: Tensor, on_points: Callable[[int], None]) -> tuple[Tensor, Tensor]:
    """Values u (P,) of points (P, 3) and the share (P,) of the density that drawings and hull leave, chunk by chunk."""
    us, shares = [points.new_zeros(0)], [points.new_zeros(0)]
    for some in points.split(points_at_once(scene.field)):
        densities, share = scene.field.uncut_densities(some)
        us.append(u_from_densities(densities))
        shares.append(share * scene.bounds.may_hold(some))
        on_points(len(some))
    return torch.cat(us), torch.cat(shares)


def _expected_errors(u: Tensor, kept: Tensor) -> Tensor:
    """Errors of densities halfway between points (X, Y, Z) of a lattice, 1/m: a second difference's eighth, of the worst axis.

    It is too large where what is interpolated bends at the points themselves, as most of what is read of drawings does.
    """
    curve = torch.zeros_like(u)
    for axis in range(3):
        size = u.shape[axis] - 2
        middle, ends = u.narrow(axis, 1, size), u.narrow(axis, 0, size) + u.narrow(axis, 2, size)
        inner = curve.narrow(axis, 1, size)
        torch.maximum(inner, (2.0 * middle - ends).abs(), out=inner)
    return curve / 8.0 * SCALE * torch.sigmoid(u) * kept.clamp_max(1.0)


def _missed_opacities(
    scene: Scene, lattice: Lattice, u: Tensor, kept: Tensor, cells: Tensor, step: float
) -> Tensor:
    """Errors of a step's opacity in the middles of cells (N,) by what the lattice's points (X, Y, Z) say: they may hide ridges."""
    middles = cells.nonzero() + 0.5
    us, shares = _asked(scene, lattice.points(middles), lambda number: None)
    read = between((u, kept), middles.t())
    passed, by_lattice = (torch.exp(-step * cut_densities(*one)) for one in ((us, shares), read))
    return (passed - by_lattice).abs()


@dataclass(frozen=True)
class _Fine:
    """The fine grid: which of its points are in cells that hold something; u, shares kept and errors, 1/m, of all, (X, Y, Z)."""

    used: Tensor
    u: Tensor
    kept: Tensor
    errors: Tensor
    num_evaluated: int

    @classmethod
    def of(cls, scene: Scene, coarse: _Coarse, factor: int, on_points: Callable[[int], None]) -> "_Fine":
        """Evaluate the points of bent cells that are not on the lattice; interpolate those of others.

        The error of a density is that of the lattice, which the new points show, over the square of the factor; where none were
        asked for it is the expected one.
        """
        lattice, used = coarse.lattice, finer_points(coarse.holding, factor)
        places = used.nonzero()
        index = used.int()
        index[used] = torch.arange(len(places), dtype=torch.int32, device=index.device)
        rows = torch.stack([one.reshape(-1) for one in (coarse.u, coarse.kept, coarse.errors)], dim=-1)
        numbers = torch.arange(len(rows), dtype=torch.int32, device=index.device).view(lattice.shape)
        filled = interpolated(numbers, rows, places.to(rows.dtype) / factor)
        added = (places % factor != 0).any(-1)
        filled[~added, 2] = 0.0
        new = finer_points(coarse.bent, factor)[used] & added
        us, shares = _asked(scene, lattice.points(places[new], factor), on_points)
        off = (cut_densities(us, shares) - cut_densities(filled[new, 0], filled[new, 1])).abs()
        filled[new] = torch.stack((us, shares, off / factor**2), dim=-1)
        filled[:, 0] = _without_bias(filled[:, 0], index, places, factor)
        spread = [rows.new_full(used.shape, nothing) for nothing in (EMPTY_U, 0.0, 0.0)]
        for volume, values in zip(spread, filled.unbind(-1), strict=True):
            volume[used] = values
        spread_u, spread_kept, spread_errors = spread
        return cls(used, spread_u, spread_kept, spread_errors, len(us))


def _without_bias(u: Tensor, index: Tensor, places: Tensor, factor: int) -> Tensor:
    """Values u (P,) of places (P, 3) such that what is interpolated between them is right in the mean, where u is curved.

    Straight lines between points of a curve run on its inner side: thin things lose density. Points between those of the lattice,
    where fields bend, are moved to the outer side by the curve's second difference; nothing else is, and no point beside nothing.

    Args:
        u: As it was found.
        index: Numbers of the places, (X, Y, Z).
        places: Points of the fine grid.
        factor: Steps of it in one of the lattice.
    """
    moved = u.clone()
    share = factor / (
        12.0 * max(1, factor - 1)
    )  # a step's twelfth for all points of an interval but its first
    for axis in range(3):
        inner = (places[:, axis] % factor != 0).nonzero()[:, 0]
        step = torch.eye(3, dtype=places.dtype, device=places.device)[axis]
        before, after = (u[index[tuple((places[inner] + way).T)].long()] for way in (-step, step))
        curve = 2.0 * u[inner] - before - after
        jumps = torch.minimum(torch.minimum(before, after), u[inner]) <= EMPTY_U
        moved[inner] += torch.where(jumps, 0.0, share * curve)
    return moved


def _of_cells(values: Tensor, factor: int) -> Tensor:
    """Means of values (X, Y, Z) of the fine grid over the lattice's cells, ((X - 1) / factor, ...), their borders included."""
    return F.avg_pool3d(values[None, None], factor + 1, stride=factor)[0, 0]


def _colors(scene: Scene, coarse: _Coarse, on_points: Callable[[int], None]) -> tuple[Tensor, Tensor]:
    """Index and rows of the colours of the corners of refined cells; none where the field has no coloring."""
    wanted, field, coloring = corners_of(coarse.refined), scene.field, scene.field.coloring
    if coloring is None or not bool(wanted.any()):
        return torch.zeros_like(wanted, dtype=torch.int32), coarse.u.new_zeros(1, 1)
    points = coarse.lattice.points(wanted.nonzero())
    directions = sampled_directions().to(points)
    into, back = projection(points), polynomials(directions)
    index = wanted.int()
    index[wanted] = torch.arange(1, len(points) + 1, dtype=torch.int32, device=index.device)
    rows = []
    for some in points.split(points_at_once(field)):
        parts = field.appearance(some, directions)  # (P, K, C)
        coefficients = torch.einsum("bk,pkc->pbc", into, parts)
        fitted = torch.einsum("kb,pbc->pkc", back, coefficients)
        exact, kept = (coloring.rgb_of(some, one.transpose(0, 2).contiguous()) for one in (parts, fitted))
        off = expected_error((exact - kept).abs().amax(0))
        rows.append(torch.cat((coefficients.flatten(1), off[:, None]), dim=-1))
        on_points(COLOR_COST * len(some))
    filled = torch.cat((torch.zeros_like(rows[0][:1]), *rows))
    filled[1:, -1] += _missed_between(scene, coarse, index, filled)[wanted]
    return index, filled


def _missed_between(scene: Scene, coarse: _Coarse, index: Tensor, rows: Tensor) -> Tensor:
    """Errors of colours in the middles of cells, seen into the surface: the largest around each of the points (X, Y, Z).

    Of every second cell, as on a chess board: four of those around a point.
    """
    field, coloring, densities = scene.field, scene.field.coloring, coarse.densities
    assert coloring is not None  # its caller has asked
    x, y, z = (torch.arange(size, device=densities.device) for size in coarse.refined.shape)
    cells = coarse.refined & ((x[:, None, None] + y[:, None] + z) % 2 == 0)
    slopes = torch.stack([_difference(densities, axis)[cells] for axis in range(3)], dim=-1)
    flat = slopes.norm(dim=-1, keepdim=True) < 1e-6
    inward = torch.where(flat, slopes.new_tensor((0.0, 1.0, 0.0)), slopes)
    inward = inward / inward.norm(dim=-1, keepdim=True)
    middles = cells.nonzero() + 0.5
    points, size = coarse.lattice.points(middles), points_at_once(field)
    found = combined(interpolated(index, rows, middles)[:, :-1], polynomials(inward))
    pieces = zip(points.split(size), inward.split(size), found.split(size), strict=True)
    off = [
        (coloring.rgb_of(at, by.t()).t() - field(at, along).rgb).abs().amax(-1) for at, along, by in pieces
    ]
    errors = densities.new_zeros(densities.shape)
    errors[:-1, :-1, :-1][cells] = torch.cat(off)
    return _largest_before(errors)  # the cells around a point begin at it or a step before


def _difference(values: Tensor, axis: int) -> Tensor:
    """Differences along an axis, of points (X, Y, Z), summed over the cells (X - 1, Y - 1, Z - 1)."""
    for other in range(3):
        size = values.shape[other] - 1
        first, second = values.narrow(other, 0, size), values.narrow(other, 1, size)
        values = second - first if other == axis else first + second
    return values


def _largest_before(values: Tensor) -> Tensor:
    """Largest of the values (X, Y, Z) of each point and of those up to one step before it along every axis."""
    for axis in range(3):
        size = values.shape[axis] - 1
        later = torch.maximum(values.narrow(axis, 0, size), values.narrow(axis, 1, size))
        values = torch.cat((values.narrow(axis, 0, 1), later), dim=axis)
    return values
