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
class _UnderWay(TensorRecord):
    """Rays (r,) under way: their numbers, where they began and go, in cells of the lattice, where they are and end, m."""

    numbers: Tensor
    origins: Tensor
    directions: Tensor
    t_vals: Tensor
    ends: Tensor

    def at(self, t_vals: Tensor) -> Tensor:
        """Places (r, S, 3) at distances (r, S), m, counted in cells."""
        return torch.addcmul(self.origins[:, None], self.directions[:, None], t_vals[..., None])


@dataclass(frozen=True)
class _Groups(TensorRecord):
    """Groups of samples (N,): their rays, the middles of their light, m, their shares of it, and the light that comes to them."""

    rays: Tensor
    t_vals: Tensor
    weights: Tensor
    before: Tensor

    @classmethod
    def of(cls, rays: Tensor, samples: Tensor, weights: Tensor, before: Tensor, least: float) -> "_Groups":
        """Those of samples (r, S) of rays (r,) that take enough light."""
        total = weights.sum(-1)
        middles = (weights * samples).sum(-1) / total
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


def march(grid: BakedGrid, rays: RayBundle, *, unseen: float, same_color: float = 0.0) -> Seen:
    """Follow rays (R,) through a grid.

    Args:
        grid: The grid.
        rays: Rays (R,).
        unseen: Light that is followed no further; groups that take less than a fifth of it do not count.
        same_color: Share of a ray's light that has one colour: that of the place that takes most of it.
    """
    near, far = box_interval(rays, grid.low, grid.high)
    light, errors, spacing = torch.ones_like(near), torch.zeros_like(near), SPACING * grid.step
    numbers = (far > near).nonzero()[:, 0]
    way = _UnderWay(
        numbers,
        (rays.origins[numbers] - grid.origin) / grid.pitch,
        rays.directions[numbers] / grid.pitch,
        near[numbers],
        far[numbers],
    )
    offsets = (torch.arange(AT_ONCE, dtype=near.dtype, device=near.device) + 0.5) * spacing
    groups = [_Groups(numbers[:0], near[:0], near[:0], near[:0])]
    num_samples = 0
    while len(way.numbers):
        gap, free = _free_way(grid, way)
        t_vals = way.t_vals + free
        holding = (gap == 0).nonzero()[:, 0]
        if len(holding):
            here = way.rows(holding)
            samples = here.t_vals[:, None] + offsets
            lengths = (here.ends[:, None] - samples + 0.5 * spacing).clamp(0.0, spacing)
            depths, off = _read(grid, here.at(samples), lengths)
            before = light.index_select(0, here.numbers)[:, None]
            after = before * torch.exp(-depths.cumsum(-1))
            weights = torch.cat((before, after[:, :-1]), dim=-1) - after
            light.index_copy_(0, here.numbers, after[:, -1])
            errors.index_add_(0, here.numbers, (after * off).square().sum(-1))
            groups.append(_Groups.of(here.numbers, samples, weights, before[:, 0], FAINT_SHARE * unseen))
            t_vals.index_copy_(0, holding, here.t_vals + AT_ONCE * spacing)
            num_samples += samples.numel()
        on = ((t_vals < way.ends) & (light.index_select(0, way.numbers) > unseen)).nonzero()[:, 0]
        way = replace(way, t_vals=t_vals).rows(on)
    found = _Groups.joined(groups)
    moments = torch.zeros_like(light).index_add_(0, found.rays, found.weights * found.t_vals)
    places = found.by_light(len(light), same_color)
    return Seen(places.rays, places.t_vals, places.weights, moments, light, far, errors.sqrt(), num_samples)


def _free_way(grid: BakedGrid, way: _UnderWay) -> tuple[Tensor, Tensor]:
    """Cells (r,) from where rays are to the next one that holds something, and how far they may go on until then, m; 0 in it."""
    size_x, size_y, size_z = grid.gaps.shape
    at = way.at(way.t_vals[:, None])[:, 0]
    x, y, z = at.int().unbind(-1)
    flat = (x.clamp(0, size_x - 1) * size_y + y.clamp(0, size_y - 1)) * size_z + z.clamp(0, size_z - 1)
    gap = grid.gaps.reshape(-1).index_select(0, flat)
    inside = at - at.floor()
    left = torch.where(way.directions < 0.0, inside, 1.0 - inside)  # to the border of the own cell
    across = (left + (gap - 1.0)[:, None]) / way.directions.abs().clamp_min(1e-6)
    free = torch.minimum(torch.minimum(across[:, 0], across[:, 1]), across[:, 2]) + BORDER
    return gap, torch.where(gap > 0, free, 0.0)


def _read(grid: BakedGrid, at: Tensor, lengths: Tensor) -> tuple[Tensor, Tensor]:
    """Optical depths (r, S) of samples at places (r, S, 3), in cells, that stand for lengths (r, S), m, and their errors."""
    densities, errors = grid.read_densities(at.reshape(-1, 3) * grid.factor)
    return densities.view(lengths.shape) * lengths, errors.view(lengths.shape) * lengths
