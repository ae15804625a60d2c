"""Other characters out of one: a surface bent into other proportions, at random and smoothly.

Unlike a stretch of the whole world (data/augmentation/stretch.py), which a captured picture can follow, these maps bend rays: a
variant has to be captured anew.
"""

from dataclasses import replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from charnerf.capture.arms import lower_arms
from charnerf.geometry.world import HEIGHT
from charnerf.surfaces.surface_mesh import SurfaceMesh

SEPARATOR = "+"  # NAME+2 is the second variant of NAME
REACH = 1.5  # m: width and depth that no variant goes beyond to a side, unless its character did
_LOWERED_SHARE = 0.7  # of the variants
_KNOTS = np.linspace(0.0, HEIGHT, 6)  # m: feet, knees, hips, chest, head, top


def variant(surface: SurfaceMesh, rng: np.random.Generator) -> SurfaceMesh:
    """The same character in other proportions and another pose.

    Seven of ten lower their arms (capture/arms.py); all are bent as by `bent`.

    Args:
        surface: World frame, 2 m tall.
        rng: What is drawn from.

    Returns:
        Same triangles, moved: 2 m tall, feet on z = 0, middle of its box on the z axis.
    """
    return bent(posed(surface, rng), rng)


def posed(surface: SurfaceMesh, rng: np.random.Generator) -> SurfaceMesh:
    """The character, with its arms lowered in seven of ten cases."""
    lowered, drawn = lower_arms(surface, rng), rng.random() < _LOWERED_SHARE
    return replace(surface, triangles=lowered.astype(np.float32)) if drawn else surface


def bent(surface: SurfaceMesh, rng: np.random.Generator) -> SurfaceMesh:
    """The character in other proportions.

    Heights are moved along the body (long legs, large heads), width and depth are scaled by height, arms
    raised or lowered a little, the body leant and twisted; every other one is mirrored. Textures and colours stay.

    Args:
        surface: World frame, feet on z = 0.
        rng: What is drawn from.

    Returns:
        Same triangles, moved: 2 m tall, feet on z = 0, middle of its box on the z axis.
    """
    moved = _bend(surface.triangles.astype(np.float64).reshape(-1, 3), rng).reshape(-1, 3, 3)
    triangles = stand(moved, reach=np.maximum(REACH, np.abs(surface.triangles).max(axis=(0, 1))[:2]))
    corners = np.arange(3)
    if rng.random() < 0.5:
        triangles[..., 0] *= -1.0
        corners = corners[::-1]  # keeps the outside outside
    return replace(
        surface,
        triangles=np.ascontiguousarray(triangles[:, corners], dtype=np.float32),
        uvs=np.ascontiguousarray(surface.uvs[:, corners]),
        colors=np.ascontiguousarray(surface.colors[:, corners]),
    )


def _bend(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    x, y, z = points.T
    widths = _profile(rng, spread=0.16, common=0.16)(z)
    depths = _profile(rng, spread=0.16, common=0.16)(z)
    speeds = np.exp(rng.normal(0.0, 0.3, len(_KNOTS) - 1))
    heights = PchipInterpolator(_KNOTS, np.concatenate(([0.0], np.cumsum(speeds))))(z)
    heights *= HEIGHT / max(float(heights.max()), 1e-9)
    reach = max(float(np.abs(x).max()), 1e-9)
    raised = rng.normal(0.0, 0.2) * np.maximum(np.abs(x) - 0.35 * reach, 0.0)
    x, y = x * widths, y * depths
    twist = rng.normal(0.0, 0.1) * (z - 0.5 * HEIGHT)
    x, y = np.cos(twist) * x - np.sin(twist) * y, np.sin(twist) * x + np.cos(twist) * y
    upper = (z / HEIGHT) ** 2
    return np.stack(
        (x + rng.normal(0.0, 0.03) * upper, y + rng.normal(0.0, 0.06) * upper, heights + raised), axis=1
    )


def _profile(rng: np.random.Generator, *, spread: float, common: float) -> PchipInterpolator:
    """Factors over the height: smooth, between the knots' own."""
    return PchipInterpolator(
        _KNOTS, np.exp(np.clip(rng.normal(0.0, common) + rng.normal(0.0, spread, len(_KNOTS)), -0.5, 0.5))
    )


def stand(triangles: np.ndarray, *, reach: np.ndarray) -> np.ndarray:
    """Triangles (M, 3, 3) brought to 2 m, feet on z = 0, middle of their box on the z axis, within a reach (x, y), m."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle = np.array(((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]))
    standing = (triangles - middle) * (HEIGHT / max(float(high[2] - low[2]), 1e-9))
    reached = np.abs(standing).max(axis=(0, 1))[:2]
    standing[..., :2] *= np.minimum(1.0, reach / np.maximum(reached, 1e-9))
    return standing
