"""Where a field's surface lies: where some of the light is gone on the clearest way in.

A density says how likely matter begins at a place, given that light has come so far. Where a field knows the depth of a surface its
density jumps there; where it does not it spreads it, and no place is dense: a surface of constant density is then full of holes or,
drawn at less, takes in haze elsewhere. What has come to a place is lost on the way, whatever that way's densities: its optical
depth. A place is inside where every way out is that deep, so that one surface serves sharp and hazy parts.

Of captured characters that the weights never saw it puts surfaces 1 to 2 mm nearer to the truth than the density at which rendered
depths lie best, with a third of the holes (docs/meshes.md).

Letters: X, Y, Z grid points along the axes.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

LIGHT_GONE = 0.3
"""Share of the light that is gone at the surface. Half would be the likeliest depth along one way; of 26 the clearest has less."""
AHEAD = 0.01
"""m: how much farther in light is followed, by the density where it is. A surface that the field is sure of is drawn where the
density jumps, not as much deeper as the light takes; haze hardly notices."""
SURFACE = -math.log(1.0 - LIGHT_GONE)
"""Optical depth of the surface."""


def surface_values(densities: np.ndarray, spacing: float) -> np.ndarray:
    """What is at least SURFACE inside: the optical depth AHEAD of each grid point, on the clearest way in.

    Args:
        densities: (X, Y, Z), 1/m; what lies beyond the grid is empty.
        spacing: Edge of a cell, m.

    Returns:
        (X, Y, Z), float32.
    """
    ahead = np.float32(AHEAD) * densities.astype(np.float32, copy=False)
    return least_optical_depth(densities, spacing) + ahead


def least_optical_depth(densities: np.ndarray, spacing: float) -> np.ndarray:
    """Optical depth of each grid point along the clearest of the 26 straight ways in through neighbouring points.

    By the trapezoid rule, whose error falls with the square of the spacing where the density is smooth.

    Args:
        densities: (X, Y, Z), 1/m; what lies beyond the grid is empty.
        spacing: Edge of a cell, m.

    Returns:
        (X, Y, Z), float32; 0 on the outermost layer where that is empty.
    """
    least = np.full(densities.shape, np.inf, np.float32)
    for axis in range(3):
        layers = np.ascontiguousarray(np.moveaxis(densities, axis, 0), np.float32)
        lowest = np.full_like(layers, np.inf)
        for across in product((-1, 0, 1), repeat=2):
            if any(across[:axis]):  # an axis before went that way
                continue
            half = np.float32(0.5 * spacing * math.sqrt(1 + across[0] ** 2 + across[1] ** 2))
            _march(layers, lowest, across, half)
            _march(layers[::-1], lowest[::-1], across, half)
        np.minimum(least, np.moveaxis(lowest, 0, axis), out=least)
    return least


def _march(layers: np.ndarray, least: np.ndarray, across: tuple[int, ...], half: np.float32) -> None:
    """Go through layers, (N, A, B), from the first to the last by steps sideways; `least` (N, A, B) is lowered to what is found."""
    shape = layers.shape[1:]
    # depths half a step beyond the layer before, a rim of nothing around
    come = np.zeros([size + 2 for size in shape], np.float32)
    here = tuple(slice(1, 1 + size) for size in shape)
    there = tuple(slice(1 - step, 1 - step + size) for size, step in zip(shape, across, strict=True))
    for layer, lowest in zip(layers, least, strict=True):
        added = half * layer
        depth = come[there] + added
        np.minimum(lowest, depth, out=lowest)
        np.add(depth, added, out=come[here])
