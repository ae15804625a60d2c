"""Which colours a figure is painted in, and how far two figures share them: drawings of two designs are seldom one character."""

import numpy as np
from scipy import ndimage
from skimage.color import rgb2lab

BINS = (6, 10, 10)  # of lightness and the two axes of hue, CIELAB
HUES = 60.0  # up to which an axis of hue is told apart
PAINT = 0.9  # alpha from which a pixel is paint, not outline
FEW_SHARED = (
    0.33  # of 680 sides and backs none shares less with its own front, four of ten with another character's
)


def palette(rgba: np.ndarray) -> np.ndarray:
    """A blurred histogram of a figure's (H, W, 4) colours in CIELAB that sums to 1; zeros without paint."""
    lab = rgb2lab(rgba[..., :3])[rgba[..., 3] > PAINT]
    low, high = np.array((0.0, -HUES, -HUES)), np.array((100.0, HUES, HUES))
    index = ((lab - low) / (high - low) * BINS).clip(0.0, np.array(BINS) - 1.0).astype(int)
    counts = np.zeros(BINS)
    np.add.at(counts, tuple(index.T), 1.0)
    blurred = ndimage.gaussian_filter(counts, 1.0, mode="nearest")
    return np.asarray(blurred / max(blurred.sum(), 1e-12))


def shared_colors(one: np.ndarray, other: np.ndarray) -> float:
    """Share of two palettes that is the same, 0 to 1."""
    return float(np.minimum(one, other).sum())
