"""How well two outlines agree that ought to be one.

Letters: S side of a canvas, rows and columns.
"""

import numpy as np
from scipy import ndimage

TOLERANCE = 1.0 / 128.0  # of the canvas' side: outlines this near to each other agree


def share_apart(first: np.ndarray, second: np.ndarray, *, tolerance: float = TOLERANCE) -> float:
    """Share of two figures' pixels that lie farther from the other figure's than a tolerance.

    Args:
        first: Alpha (S, S).
        second: Alpha (S, S).
        tolerance: As a share of the side.

    Returns:
        In [0, 1]; 1 where one of them alone shows nothing, 0 where neither shows anything.
    """
    shown, other = first > 0.5, second > 0.5
    union = shown | other
    if not shown.any() or not other.any():
        return float(union.any())
    reach = tolerance * first.shape[0]
    far = shown & (ndimage.distance_transform_edt(~other) > reach)
    far |= other & (ndimage.distance_transform_edt(~shown) > reach)
    return float(far.sum() / union.sum())


def iou(first: np.ndarray, second: np.ndarray) -> float:
    """Intersection over union of two alphas (S, S) at one half; 0 where both are empty."""
    union = int(((first > 0.5) | (second > 0.5)).sum())
    return int(((first > 0.5) & (second > 0.5)).sum()) / union if union else 0.0
