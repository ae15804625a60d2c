"""One height for a belt in every view: rows of two views of a character matched by their colours, in order.

Letters: S rows of a canvas, K offsets tried, C numbers that describe a row.
"""

import numpy as np
from scipy import ndimage
from skimage.color import rgb2lab

REACH = 8.0 / 128.0  # share of the side by which a row may lie off
STEP = 0.5 / 128.0
CHANGE_COST = 2.0  # of an offset that changes by one step from row to row
WORST = 3.0  # beyond this, rows are merely different: a face and the back of a head
LEAST_GAIN = 0.13  # of the cost of leaving rows as they are; agreeing views came to at most 0.12


def row_offsets(fixed: np.ndarray, moving: np.ndarray) -> np.ndarray | None:
    """Offsets of the rows of one view that bring them to the heights of another's.

    The best order-keeping match of the rows' mean colours and spreads, by dynamic programming over offsets.

    Args:
        fixed: RGBA (S, S, 4) of the view that rules, S as that of flows.
        moving: RGBA (S, S, 4) of the other one.

    Returns:
        Row of the moving view for each row of the fixed one, relative to it, (S,), shares of the side; None where
        leaving them is as good.
    """
    side = fixed.shape[0]
    offsets = np.arange(-REACH, REACH + 0.5 * STEP, STEP) * side
    cost = _costs(fixed, moving, offsets)
    moves = np.abs(offsets[:, None] - offsets[None]) / (STEP * side)
    penalty = np.where(moves > 1.01, np.inf, 0.5 * CHANGE_COST * moves)
    total, steps = cost[0], []
    for row in range(1, side):
        through = total[:, None] + penalty
        steps.append(through.argmin(axis=0))
        total = through.min(axis=0) + cost[row]
    unmoved = float(cost[:, len(offsets) // 2].sum())
    if unmoved - float(total.min()) <= LEAST_GAIN * unmoved:
        return None
    path = [int(total.argmin())]
    for step in reversed(steps):
        path.append(int(step[path[-1]]))
    smooth = ndimage.gaussian_filter1d(offsets[path[::-1]], 2.0, mode="nearest")
    return (smooth / side).astype(np.float32)


def _costs(fixed: np.ndarray, moving: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """How unlike each row of the fixed view is to the moving one's at each offset, (S, K)."""
    (first, first_there), (second, second_there) = _described(fixed), _described(moving)
    rows = np.arange(len(first))
    columns = []
    for offset in offsets:
        read = np.stack([np.interp(rows + offset, rows, values) for values in second.T], axis=1)
        there = np.interp(rows + offset, rows, second_there.astype(np.float64)) > 0.5
        unlike = np.minimum(np.abs(first - read).sum(axis=1), WORST)
        columns.append(np.where(first_there & there, unlike, np.where(first_there != there, WORST, 0.0)))
    return np.stack(columns, axis=1)


def _described(rgba: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and spread of the figure's colours in each row, (S, 6), and which rows show it, (S,)."""
    lab, inside = rgb2lab(rgba[..., :3]), (rgba[..., 3] > 0.5)[..., None]
    count = np.maximum(inside.sum(axis=1), 1)
    mean = (lab * inside).sum(axis=1) / count
    spread = np.sqrt((np.square(lab - mean[:, None]) * inside).sum(axis=1) / count)
    described = ndimage.gaussian_filter1d(np.concatenate((mean / 20.0, spread / 30.0), axis=1), 1.0, axis=0)
    return described, np.asarray(inside.any(axis=(1, 2)))
