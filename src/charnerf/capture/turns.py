"""Smooth turns of points: how limbs are moved."""

import numpy as np


def turned(
    first: np.ndarray, second: np.ndarray, about: tuple[float, float], angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates turned about a place, by angles from the first axis towards the second."""
    a, b = first - about[0], second - about[1]
    cos, sin = np.cos(angles), np.sin(angles)
    return about[0] + cos * a - sin * b, about[1] + sin * a + cos * b


def rise(values: np.ndarray, start: float, end: float) -> np.ndarray:
    """0 before start, 1 after end, smooth between."""
    t = np.clip((values - start) / (end - start), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
