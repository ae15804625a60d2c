"""Rays through a baked grid: empty space is stepped over, and nothing is looked at behind opaque surface.

Letters: R rays, r those under way, S samples at once, N groups of samples, P places that have a colour of their own.
"""

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from charnerf.geometry.rays import box_interval
from charnerf.types import RayBundle, TensorRecord
from charnerf.volume.baking.grid import BakedGrid

AT_ONCE = 3  # samples of a ray between two looks at how much light is left: a group
SPACING = 1.5  # steps of the fine grid between samples
FAINT_SHARE = (
    0.2  # of the light that is followed no further: groups that take less have no colour of their own
)
MOST_SHARES = 64  # of a ray's light; where colours are to be finer than that each group has its own
BORDER = 1e-5  # m that a ray goes on beyond the border of a cell, so that rounding does not hold it there


@dataclass(frozen=True)
class Seen:
    """What rays (R,) meet in a grid.

    Attributes:
        rows: The rays of the places that have colours, (P,).
        t_vals: Where these lie, (P,), m.
        weights: Their shares of their ray's light, (P,).
        moments: Sums of distances by shares of light, (R,), m.
        passed: Light that is left, (R,).
        far: Where they leave the grid, (R,), m.
        errors: Of the rays' opacity, estimated, (R,).
        num_samples: Densities read.
    """

    rows: Tensor
    t_vals: Tensor
    weights: Tensor
    moments: Tensor
    passed: Tensor
    far: Tensor
    errors: Tensor
    num_samples: int


@dataclass(frozen=True)
class _UnderWay:
    """Rays under way: their numbers (r,), and where they are.

    Values are 11 rows of r: where they began and go, in cells of the lattice, and how slow they are, in m a cell, along x, y and
    z each; where they are and where they end, m. They lie one after the other, so that every step is few long passes over memory.
    """

    numbers: Tensor
    values: Tensor

    @classmethod
    def of(cls, grid: BakedGrid, rays: RayBundle, near: Tensor, far: Tensor) -> "_UnderWay":
        """Those of rays (R,) that are within a grid somewhere, from near to far (R,), m."""
        numbers = (far > near).nonzero()[:, 0]
        some = rays.rows(numbers)
        origins, directions = (some.origins - grid.origin).t() / grid.pitch, some.directions.t() / grid.pitch
        slowness = directions.abs().clamp_min_(1e-6).reciprocal_()
        interval = torch.stack((near, far)).index_select(1, numbers)
        return cls(numbers, torch.cat((origins, directions, slowness, interval)))

    def some(self, index: Tensor) -> "_UnderWay":
        """Those of numbers (n,) among these."""
        return _UnderWay(self.numbers.index_select(0, index), self.values.index_select(1, index))

    @property
    def directions(self) -> Tensor:
        """Where they go, (3, r), in cells a m."""
        return self.values[3:6]

    @property
    def slowness(self) -> Tensor:
        """(3, r), m a cell."""
        return self.values[6:9]

    @property
    def t_vals(self) -> Tensor:
        """Where they are, (r,), m; moves."""
        return self.values[9]

    @property
    def ends(self) -> Tensor:
        """(r,), m."""
        return self.values[10]

    def at(self, t_vals: Tensor) -> Tensor:
        """Places (3, ..., r) at distances (..., r), m, counted in cells."""
        shape = (3, *[1] * (t_vals.ndim - 1), -1)
        return torch.addcmul(self.values[:3].view(shape), self.directions.view(shape), t_vals)


@dataclass(frozen=True)
class _Groups(TensorRecord):
    """Groups of samples (N,): their rays, the middles of their light, m, their shares of it, and the light that comes to them."""

    rays: Tensor
    t_vals: Tensor
    weights: Tensor
    before: Tensor

    @classmethod
    def of(cls, rays: Tensor, samples: Tensor, weights: Tensor, before: Tensor, least: float) -> "_Groups":
        """Those of samples (S, r) of rays (r,) that take enough light."""
        total = weights.sum(0)
        middles = (weights * samples).sum(0) / total
        return cls(rays, middles, total, before).rows((total > least).nonzero()[:, 0])

    def by_light(self, num_rays: int, same_color: float) -> "_Groups":
        """Of those that light comes to within the same share of a ray's light the heaviest, for all of them."""
        if same_color * MOST_SHARES < 1.0:
            return self
        shares = math.ceil(1.0 / same_color)
        key = self.rays * shares + ((1.0 - self.before) * shares).long().clamp_(0, shares - 1)
        total = self.weights.new_zeros(num_rays * shares)
        heaviest = total.scatter_reduce(0, key, self.weights, "amax")
        chosen = (self.weights == heaviest.index_select(0, key)).nonzero()[:, 0]
        key_of = key.index_select(0, chosen)
        equal = torch.zeros_like(total).index_add_(0, key_of, torch.ones_like(chosen, dtype=total.dtype))
        weights = (total.index_add_(0, key, self.weights) / equal.clamp_min_(1.0)).index_select(0, key_of)
        return replace(self.rows(chosen), weights=weights)


def march(
    grid: BakedGrid, rays: RayBundle, *, unseen: float, same_color: float = 0.0, spacing: float = SPACING
) -> Seen:
    """Follow rays (R,) through a grid.

    Args:
        grid: The grid.
        rays: Rays (R,).
        unseen: Light that is followed no further; groups that take less than a fifth of it do not count.
        same_color: Share of a ray's light that has one colour: that of the place that takes most of it.
        spacing: Between samples, in steps of the fine grid.
    """
    near, far = box_interval(rays, grid.low, grid.high)
    light, errors, spacing = torch.ones_like(near), torch.zeros_like(near), spacing * grid.step
    way = _UnderWay.of(grid, rays, near, far)
    offsets = (torch.arange(AT_ONCE, dtype=near.dtype, device=near.device)[:, None] + 0.5) * spacing
    groups, num_samples = [_Groups(way.numbers[:0], near[:0], near[:0], near[:0])], 0
    while len(way.numbers):
        cells, gap, free = _free_way(grid, way)
        holding = (gap == 0).nonzero()[:, 0]
        if len(holding):
            here = way.some(holding)
            samples = here.t_vals + offsets
            lengths = (here.ends - samples).add_(0.5 * spacing).clamp_(0.0, spacing)
            at = here.at(samples).mul_(grid.factor).view(3, -1)
            depths = grid.read_densities(at).view(samples.shape).mul_(lengths)
            before = light.index_select(0, here.numbers)
            after = torch.exp(depths.cumsum(0).neg_()).mul_(before)
            weights = torch.cat((before[None], after[:-1])).sub_(after)
            light.index_copy_(0, here.numbers, after[-1])
            off = grid.errors.view(-1).index_select(0, cells.index_select(0, holding))
            errors.index_add_(0, here.numbers, (after.mul_(lengths)).square_().sum(0).mul_(off.square_()))
            groups.append(_Groups.of(here.numbers, samples, weights, before, FAINT_SHARE * unseen))
            free.index_fill_(0, holding, AT_ONCE * spacing)
            num_samples += samples.numel()
        way.t_vals.add_(free)
        on = (way.t_vals < way.ends).logical_and_(light.index_select(0, way.numbers) > unseen)
        way = way.some(on.nonzero()[:, 0])
    found = _Groups.joined(groups)
    moments = torch.zeros_like(light).index_add_(0, found.rays, found.weights * found.t_vals)
    places = found.by_light(len(light), same_color)
    return Seen(places.rays, places.t_vals, places.weights, moments, light, far, errors.sqrt(), num_samples)


def _free_way(grid: BakedGrid, way: _UnderWay) -> tuple[Tensor, Tensor, Tensor]:
    """Numbers (r,) of the cells that rays are in, cells to the next one that holds something (r,), and how far they may go, m.

    That is meaningless in a cell that holds something.
    """
    size_x, size_y, size_z = grid.gaps.shape
    at = way.at(way.t_vals)
    x, y, z = at.int()
    cells = (
        (x.clamp_(0, size_x - 1) * size_y + y.clamp_(0, size_y - 1))
        .mul_(size_z)
        .add_(z.clamp_(0, size_z - 1))
    )
    gap = grid.gaps.view(-1).index_select(0, cells)
    inside = at.sub_(at.floor())
    left = torch.where(way.directions < 0.0, inside, 1.0 - inside)  # to the border of the own cell
    return cells, gap, (left.add_(gap - 1.0)).mul_(way.slowness).amin(0).add_(BORDER)
