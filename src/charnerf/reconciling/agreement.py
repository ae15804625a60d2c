"""How well two outlines agree that ought to be one.

Letters: S side of a canvas, rows and columns.
"""

import numpy as np
from scipy import ndimage

TOLERANCE = 1.0 / 128.0  # of the canvas' side: outlines this near to each other agree


def disagreement(first: np.ndarray, second: np.ndarray, *, tolerance: float = TOLERANCE) -> np.ndarray:
    """By row, the share of the figures' pixels that lie farther from the other figure's than a tolerance.

    Args:
        first: Alpha (S, S).
        second: Alpha (S, S).
        tolerance: As a share of the side.

    Returns:
        (S,) in [0, 1]; 0 where neither shows anything.
    """
    far, union = _far_pixels(first > 0.5, second > 0.5, tolerance)
    return far.sum(axis=1) / np.maximum(union.sum(axis=1), 1)


def share_apart(first: np.ndarray, second: np.ndarray, *, tolerance: float = TOLERANCE) -> float:
    """As `disagreement`, of all rows together; 1 where one of them shows nothing."""
    far, union = _far_pixels(first > 0.5, second > 0.5, tolerance)
    return float(far.sum() / union.sum()) if union.any() else 0.0


def iou(first: np.ndarray, second: np.ndarray) -> float:
    """Intersection over union of two alphas (S, S) at one half; 0 where both are empty."""
    union = int(((first > 0.5) | (second > 0.5)).sum())
    return int(((first > 0.5) & (second > 0.5)).sum()) / union if union else 0.0


def _far_pixels(first: np.ndarray, second: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of either figure that are far from the other one, and pixels of either."""
    union = first | second
    if not first.any() or not second.any():
        return union, union
    reach = tolerance * first.shape[0]
    far = first & (ndimage.distance_transform_edt(~second) > reach)
    far |= second & (ndimage.distance_transform_edt(~first) > reach)
    return far, union
