"""References in high precision (mpmath): light through a medium, and the media with closed forms."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import mpmath
import torch
from torch import Tensor

DIGITS = 50
MPF = mpmath.mpf


@dataclass(frozen=True)
class ExactLight:
    """Rounded to float64: weights (N, S), final (N,), colour (N,), its gradient to optical depths (N, S)."""

    weights: Tensor
    final: Tensor
    color: Tensor
    gradients: Tensor


def exact_light(densities: Tensor, deltas: Tensor, colors: Tensor, background: float) -> ExactLight:
    """Compositing of rays in 50 digits, from the very numbers that the kernel got.

    Args:
        densities: (N, S), any dtype.
        deltas: (N, S).
        colors: (S,), one channel.
        background: Of the same channel.
    """
    weights, finals, seen, gradients = [], [], [], []
    shades = [MPF(c) for c in colors.tolist()]
    with mpmath.workdps(DIGITS):
        for sigma, delta in zip(densities.double().tolist(), deltas.double().tolist(), strict=True):
            taus = [MPF(s) * MPF(d) for s, d in zip(sigma, delta, strict=True)]
            row, passing = _ray(taus)
            color = sum((w * c for w, c in zip(row, shades, strict=True)), MPF(0)) + passing[-1] * MPF(
                background
            )
            behind = passing[-1] * MPF(background)
            slopes = []
            for index in range(len(taus) - 1, -1, -1):
                slopes.append(passing[index + 1] * shades[index] - behind)
                behind += row[index] * shades[index]
            weights.append([float(w) for w in row])
            finals.append(float(passing[-1]))
            seen.append(float(color))
            gradients.append([float(s) for s in reversed(slopes)])
    return ExactLight(
        *(torch.tensor(part, dtype=torch.float64) for part in (weights, finals, seen, gradients))
    )


def _ray(taus: list) -> tuple[list, list]:
    """Weights (S) and transmittance before each sample and after the last (S + 1)."""
    total, passing, row = MPF(0), [MPF(1)], []
    for tau in taus:
        row.append(-mpmath.expm1(-tau) * passing[-1])
        total += tau
        passing.append(mpmath.exp(-total))
    return row, passing


def exactly(function: Callable, values: Tensor) -> Tensor:
    """A function of mpmath at every number of a tensor, rounded to float64."""
    with mpmath.workdps(DIGITS):
        answers = [float(function(MPF(value))) for value in values.double().flatten().tolist()]
    return torch.tensor(answers, dtype=torch.float64).reshape(values.shape)


@dataclass(frozen=True)
class Medium:
    """A medium on [0, 1] of peak density 1 whose optical depth from 0 to t has a closed form."""

    name: str
    depth: Callable

    def bin_depths(self, num_bins: int) -> list:
        """Optical depth of each of num_bins equal bins, in 50 digits."""
        with mpmath.workdps(DIGITS):
            edges = [self.depth(MPF(i) / num_bins) for i in range(num_bins + 1)]
            return [after - before for before, after in pairwise(edges)]


def _wall(start: str, end: str) -> Callable:
    return lambda t: max(MPF(0), min(t, MPF(end)) - MPF(start))


MEDIA = (
    Medium("homogeneous slab", lambda t: t),
    Medium("step wall", _wall("0.47", "1")),
    Medium("two walls", lambda t: _wall("0.31", "0.33")(t) + _wall("0.7", "0.74")(t)),
    Medium("exponential density", lambda t: -mpmath.expm1(-5 * t) / 5),
    Medium("linear density", lambda t: t * t / 2),
    Medium("thin shell", _wall("0.5", "0.501")),
)


def closed_form_weights(medium: Medium, num_bins: int, scales: Tensor) -> Tensor:
    """Differences of the exact transmittance over equal bins at peak densities (N,), 1/m: (N, num_bins)."""
    rows = []
    with mpmath.workdps(DIGITS):
        edges = [medium.depth(MPF(i) / num_bins) for i in range(num_bins + 1)]
        for scale in scales.double().tolist():
            row = []
            for before, after in pairwise(edges):
                row.append(
                    float(mpmath.exp(-MPF(scale) * before) * -mpmath.expm1(-MPF(scale) * (after - before)))
                )
            rows.append(row)
    return torch.tensor(rows, dtype=torch.float64)
