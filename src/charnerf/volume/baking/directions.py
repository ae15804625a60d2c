"""How colours of a place change with the direction that it is looked at along: polynomials on the sphere up to degree 2.

Letters: P points, K directions, B = 9 polynomials.
"""

import math

import torch
from torch import Tensor

NUM_POLYNOMIALS = 9


def polynomials(view_dirs: Tensor) -> Tensor:
    """Orthonormal polynomials of unit directions (P, 3): (P, 9), their mean square over the sphere 1."""
    x, y, z = view_dirs.unbind(-1)
    first, second = math.sqrt(3.0), math.sqrt(15.0)
    return torch.stack(
        (
            torch.ones_like(x),
            first * x,
            first * y,
            first * z,
            second * x * y,
            second * y * z,
            second * z * x,
            0.5 * second * (x * x - y * y),
            0.5 * math.sqrt(5.0) * (3.0 * z * z - 1.0),
        ),
        dim=-1,
    )


def sampled_directions() -> Tensor:
    """The 12 corners of an icosahedron, (12, 3) unit, float64: their mean is the sphere's for polynomials up to degree 5."""
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    pairs = torch.tensor([(a, b * golden) for a in (-1.0, 1.0) for b in (-1.0, 1.0)], dtype=torch.float64)
    zero = torch.zeros(4, dtype=torch.float64)
    corners = torch.cat([torch.stack((zero, *pairs.T), dim=-1).roll(axis, dims=-1) for axis in range(3)])
    return corners / math.hypot(1.0, golden)


def projection(like: Tensor) -> Tensor:
    """From values at `sampled_directions` (12) to coefficients of `polynomials`: (9, 12), of least squares."""
    directions = sampled_directions()
    return (polynomials(directions).T / len(directions)).to(like)


def expected_error(left: Tensor) -> Tensor:
    """Root mean square over the sphere (...) of what polynomials miss, by what they leave at `sampled_directions`, (12, ...).

    Least squares leave about (12 - 9) / 12 of a square there: the coefficients take the rest along.
    """
    return (left.square().sum(0) / (len(left) - NUM_POLYNOMIALS)).sqrt()
