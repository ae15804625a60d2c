"""Lines drawn along a figure's outline: they say where it ends, and are no paint on it.

Seen from elsewhere an outline lies in the middle of the figure, where a line that became paint would be a black streak.

Letters: H, W of the drawing as read.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

WIDEST = 0.02  # share of the figure's height that a line is wide at most
DARKER = 0.12  # brightness by which ink lies below the paint beside it, at least
DARKEST = 0.65  # of the paint's brightness that ink has at most
INKED = 0.3  # share of outlines, in the mean of all views, that must be inked: less are dark hems and shadows
GREY = np.array((0.299, 0.587, 0.114), np.float32)


@dataclass(frozen=True)
class OutlineInk:
    """The line along a figure's outline.

    Attributes:
        line: Its pixels, those beside it that it is mixed with included, (H, W) bool.
        share: Of the outline that it covers.
    """

    line: np.ndarray
    share: float


def find_outline_ink(rgba: np.ndarray) -> OutlineInk:
    """Find the thin line, darker than the paint beside it, along the outline of a figure (H, W, 4), straight alpha."""
    inside = rgba[..., 3] > 0.5
    rows = np.flatnonzero(inside.any(axis=1))
    depth = ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    widest = max(2.0, WIDEST * float(rows[-1] + 1 - rows[0])) if len(rows) else 2.0
    core = depth > widest
    if not core.any():
        return OutlineInk(np.zeros_like(inside), 0.0)
    grey = rgba[..., :3] @ GREY
    paint = grey[tuple(ndimage.distance_transform_edt(~core, return_distances=False, return_indices=True))]
    band = inside & ~core
    dark = band & (paint - grey > DARKER) & (grey < DARKEST * paint)
    outline = inside & (depth < 2.0)
    ink = ndimage.binary_propagation(dark & outline, mask=dark, structure=np.ones((3, 3), dtype=bool))
    beside = band | (rgba[..., 3] > 0.0) & ~inside
    return OutlineInk(
        line=ndimage.binary_dilation(ink) & beside,
        share=float((dark & outline).sum() / max(int(outline.sum()), 1)),
    )


def painted_over(rgba: np.ndarray, ink: OutlineInk) -> np.ndarray:
    """A figure (H, W, 4) whose outline has the colours that lie beside its line inside."""
    paint = (rgba[..., 3] > 0.5) & ~ink.line
    nearest = ndimage.distance_transform_edt(~paint, return_distances=False, return_indices=True)
    result = rgba.copy()
    result[ink.line, :3] = rgba[tuple(axis[ink.line] for axis in nearest)][:, :3]
    return result
