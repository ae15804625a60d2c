"""One character on a grid: what was evaluated once and is interpolated from then on.

Letters: X, Y, Z points of the fine grid along the axes; M rows of colours; B polynomials of the direction, C values that a colour
is made of; P points, whose coordinates lie one after the other, (3, P), where densities are read: many, and in passes over memory.
"""

from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.types import MovableRecord

SCALE = 20.0  # 1/m: a density is kept as u, SCALE * softplus(u), which runs straighter between points than it does itself
EMPTY_U, OPAQUE_U = -14.0, 8.0  # of no density, and of what no light passes
LINEAR = 20.0  # from here on softplus(u) is u to rounding


def u_from_densities(densities: Tensor) -> Tensor:
    """The u (...) of densities (...), 1/m."""
    scaled = densities / SCALE
    bent = torch.log(torch.expm1(scaled.clamp_max(LINEAR)))
    return torch.where(scaled > LINEAR, scaled, bent).clamp_min(EMPTY_U)


def densities_from_u(u: Tensor) -> Tensor:
    """Densities (...), 1/m, of their u (...)."""
    return SCALE * F.softplus(u)


def cut_densities(u: Tensor, kept: Tensor) -> Tensor:
    """Densities (...), 1/m, of u (...) and of the shares of them that are left (...), above 1 all."""
    return densities_from_u(u) * kept.clamp_max(1.0)


@final
@dataclass(frozen=True)
class BakedGrid(MovableRecord):
    """Densities on a fine grid, colours on the lattice that it divides, and how far the next of them is.

    Attributes:
        low: Lower corner of where the character may be, (3,), m; nothing is beyond.
        high: Upper corner, (3,), m.
        origin: Of grid and lattice, (3,), m.
        pitch: Of the lattice, m.
        factor: Steps of the fine grid in one of the lattice.
        u: Of the fine grid's points, (X, Y, Z).
        kept: The share of their densities that is left, above 1 all, (X, Y, Z) float16.
        errors: Of the densities in the lattice's cells, ((X - 1) / factor, ...), 1/m.
        color_index: Rows of the lattice's points, ((X - 1) / factor + 1, ...) int32.
        color_rows: Coefficients of what colours are made of, and the colours' error, (M, B * C + 1); (1, 1) without colours.
        gaps: Cells, at most 255, from each of the lattice ((X - 1) / factor, ...) to the next one that holds something, along the
            axis where it is farthest, uint8; 0 where it holds something itself.
    """

    low: Tensor
    high: Tensor
    origin: Tensor
    pitch: float
    factor: int
    u: Tensor
    kept: Tensor
    errors: Tensor
    color_index: Tensor
    color_rows: Tensor
    gaps: Tensor

    @property
    def step(self) -> float:
        """Of the fine grid, m."""
        return self.pitch / self.factor

    @property
    def has_colors(self) -> bool:
        """Whether it holds what colours are made of."""
        return len(self.color_rows) > 1

    @property
    def mib(self) -> float:
        """Memory that it takes."""
        tensors = (self.u, self.kept, self.errors, self.color_index, self.color_rows, self.gaps)
        return sum(one.numel() * one.element_size() for one in tensors) / 2**20

    def densities_at(self, points: Tensor) -> Tensor:
        """Densities (P,), 1/m, at points (P, 3), m."""
        inside = ((points >= self.low) & (points <= self.high)).all(-1)
        return self.read_densities(((points - self.origin) / self.step).t().contiguous()) * inside

    def read_densities(self, at: Tensor) -> Tensor:
        """Densities (P,), 1/m, at places (3, P) counted in steps of the fine grid."""
        return cut_densities(*between((self.u, self.kept), at))

    def read_colors(self, at: Tensor, polynomials: Tensor) -> tuple[Tensor, Tensor]:
        """What colours are made of (P, C) by polynomials (P, B), and their errors (P,), at places (P, 3) in the lattice's cells."""
        read = interpolated(self.color_index, self.color_rows, at)
        return combined(read[:, :-1], polynomials), read[:, -1]


def between(volumes: tuple[Tensor, ...], at: Tensor) -> list[Tensor]:
    """Values (P,) of volumes (X, Y, Z) at places (3, P) counted in their steps, in the places' precision.

    Half the time of `interpolated`, for volumes whose points all have a value.
    """
    _, size_y, size_z = volumes[0].shape
    low = torch.minimum(at.floor().clamp_min_(0.0), at.new_tensor(volumes[0].shape)[:, None] - 2.0)
    x, y, z = low.int()
    corner, beyond = (x * size_y + y).mul_(size_z).add_(z), at - low
    steps = [(a * size_y + b) * size_z + c for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    around = (corner + corner.new_tensor(steps)[:, None]).view(-1)
    read = (one.reshape(-1).index_select(0, around).to(at.dtype) for one in volumes)
    return [_linear(corners.view(len(steps), -1), beyond) for corners in read]


def _linear(corners: Tensor, beyond: Tensor) -> Tensor:
    """Values (P,) between those of eight corners (8, P), x slowest, by places beyond the first one in steps, (3, P)."""
    for share in beyond:
        first, second = corners.chunk(2)
        corners = torch.lerp(first, second, share)
    return corners[0]


def interpolated(index: Tensor, rows: Tensor, at: Tensor) -> Tensor:
    """Rows (N, C) of points by index (X, Y, Z), between them at places (P, 3) counted in their steps: (P, C)."""
    _, size_y, size_z = index.shape
    last = at.new_tensor(index.shape) - 2.0
    low = torch.minimum(at.floor().clamp_min_(0.0), last)
    x, y, z = low.int().unbind(-1)
    corner = (x * size_y + y) * size_z + z
    steps = [(a * size_y + b) * size_z + c for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    around = corner[:, None] + torch.tensor(steps, dtype=corner.dtype, device=at.device)
    chosen = index.reshape(-1).index_select(0, around.reshape(-1)).view(-1, len(steps))
    share = (at - low).t().contiguous()  # places in a row: products of pairs side by side would be slow
    near_x, near_y, near_z = torch.stack((1.0 - share, share), dim=1)  # (2, P) each
    weights = (near_x[:, None, None] * (near_y[:, None] * near_z)).reshape(len(steps), -1).t().contiguous()
    return F.embedding_bag(chosen, rows, per_sample_weights=weights, mode="sum")


def combined(coefficients: Tensor, polynomials: Tensor) -> Tensor:
    """Values (P, C) of coefficients (P, B * C) by polynomials (P, B), term by term: half the time of small matrix products."""
    terms = coefficients.unflatten(-1, (polynomials.shape[-1], -1)).unbind(1)
    total = terms[0] * polynomials[:, :1]
    for number, term in enumerate(terms[1:], start=1):
        total.addcmul_(term, polynomials[:, number, None])
    return total
