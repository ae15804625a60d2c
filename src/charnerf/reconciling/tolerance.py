"""By how much each row of each outline may be off, so that no view carves away what an earlier one shows.

Level orthographic views of a figure have their rows in common: at one height the figure lies where every view's row
shows it. A view is let in row by row: where its outline would cut pixels of the views before it, it is widened there, no
more than is needed.

Letters: V views, S side of a canvas, rows and columns; N cells a side of the square that a row looks down on.
"""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

CELLS = 128
TOLERANCES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # pixels of 128, tried in turn
LOST = 0.02  # share of a row's pixels that may be cut before it is widened; a single pixel never matters
EDGE = 0.05  # alpha from which on a pixel belongs to a figure that is grown, as to one that is carved
SPREAD = 1  # rows beside a widened one that are widened too


def tolerances(outlines: Sequence[np.ndarray], azimuths_deg: Sequence[float]) -> np.ndarray:
    """Tolerance of every row of every outline.

    Args:
        outlines: Alphas (S, S), the views that rule first.
        azimuths_deg: Of their cameras, level, orthographic, framed alike.

    Returns:
        (V, S), pixels of 128; infinite for a view that no tolerance lets in: it carves nothing.
    """
    masks = np.stack([outline > 0.5 for outline in outlines])
    side = masks.shape[1]
    distances = np.stack([ndimage.distance_transform_edt(~mask) for mask in masks]) * (128.0 / side)
    columns = np.stack([_columns(azimuth, side) for azimuth in azimuths_deg])
    found = np.full((len(masks), side), TOLERANCES[0])
    cells = np.ones((side, CELLS * CELLS), dtype=bool)
    for view in range(len(masks)):
        found[view], cells = _let_in(view, cells, masks, distances, columns)
    return found


def widened(alpha: np.ndarray, tolerance: np.ndarray) -> np.ndarray:
    """An outline with its figure grown, in each row, to what the row may be off.

    Args:
        alpha: (S, S), any S.
        tolerance: Of the view, by row, (T,), pixels of 128.

    Returns:
        (S, S): 1 within the tolerance of the figure, the alpha itself in rows that need none, 1 everywhere where it is
        infinite.
    """
    side = len(alpha)
    rows = tolerance[(np.arange(side) + 0.5).astype(int) * len(tolerance) // side]
    reach = ((rows - TOLERANCES[0]) * (side / 128.0))[:, None]
    near = ndimage.distance_transform_edt(alpha <= EDGE) <= reach
    return np.where((reach > 0.0) & near, 1.0, alpha).astype(alpha.dtype)


def _let_in(
    view: int, cells: np.ndarray, masks: np.ndarray, distances: np.ndarray, columns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Tolerances (S,) of a view, and what is left of the cells (S, N * N) with it."""
    side = masks.shape[1]
    level = np.zeros(side, dtype=int)
    while True:
        tolerance = np.asarray(TOLERANCES)[level]
        carved = cells & (distances[view][:, columns[view]] <= tolerance[:, None])
        cut = np.zeros(side, dtype=bool)
        for other in range(view):
            cut |= _lost(masks[other], carved, columns[other]) & ~_lost(masks[other], cells, columns[other])
        if not cut.any():
            return tolerance, carved
        if (level[cut] == len(TOLERANCES) - 1).any():
            return np.full(side, np.inf), cells
        wider = ndimage.binary_dilation(cut, iterations=SPREAD)
        level = np.minimum(level + wider, len(TOLERANCES) - 1)


def _lost(mask: np.ndarray, cells: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Rows (S,) of an outline of which too many pixels see no cell."""
    seen = np.zeros_like(mask)
    order = np.argsort(columns, kind="stable")
    starts = np.flatnonzero(np.diff(columns[order], prepend=-1))
    seen[:, columns[order][starts]] = np.logical_or.reduceat(cells[:, order], starts, axis=1)
    missing = mask & ~ndimage.binary_dilation(seen, structure=np.ones((1, 3), dtype=bool))
    return missing.sum(axis=1) > np.maximum(LOST * mask.sum(axis=1), 1.0)


def _columns(azimuth_deg: float, side: int) -> np.ndarray:
    """Column of a canvas that each cell of a row projects to, (N * N,)."""
    angle = np.radians(azimuth_deg)
    place = (np.arange(CELLS) + 0.5) / CELLS - 0.5
    x, y = np.meshgrid(place, place, indexing="ij")
    across = x * np.cos(angle) + y * np.sin(
        angle
    )  # the camera's right axis at azimuth 0 is +x, at 90 it is +y
    return np.floor((across.reshape(-1) + 0.5) * side).clip(0, side - 1).astype(np.int64)
