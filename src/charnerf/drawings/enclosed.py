"""Paper that a figure encloses: the gap between arm and body, or cloth and eyes left white. Two opposite views decide.

Letters: H, W of the drawing as read.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from skimage.measure import label, regionprops

from charnerf.drawings.background import Background

SMALLEST = 8e-4  # of the figure's area; below, a soft outline closes the gap anyway
PAPERLIKE = 0.58  # mean distance from the paper, by the tolerance: gaps have up to 0.5, cloth of nearly its colour 0.68 and more
MIDDLE = 0.5  # of the height: above it, what crosses the figure's axis is a shirt or a face
LINE = 0.015  # of the height: a line so wide may close cloth off against the background
CLOSED = 0.15  # share of a region's rim with background behind such a line, from which it is cloth
APART = 0.06  # of the height: as far as the same gap may lie from its mirrored place in the opposite view
ALIKE = 3.0  # as many times as large may it be there


@dataclass(frozen=True)
class Gap:
    """A region that may be seen through.

    Attributes:
        mask: (H, W) bool.
        across: Of its centre from the figure's axis, by the figure's height; positive to the picture's right.
        up: Of its centre from the figure's upper end downwards, by the figure's height.
        area: By the square of the figure's height.
    """

    mask: np.ndarray
    across: float
    up: float
    area: float


def find_gaps(background: Background, figure: np.ndarray) -> tuple[Gap, ...]:
    """Regions of a figure (H, W) bool that have the paper's colour, and which no mere line closes off against it."""
    rows, columns = np.flatnonzero(figure.any(1)), np.flatnonzero(figure.any(0))
    if not len(rows):
        return ()
    height = int(rows[-1] + 1 - rows[0])
    axis, area = 0.5 * (columns[0] + columns[-1]), float(figure.sum())
    paper = label((background.distance <= background.tolerance) & figure, connectivity=1)
    regions = [one for one in regionprops(paper) if one.area >= SMALLEST * area]
    if not regions:
        return ()
    # what has background behind a line's width
    shallow = ndimage.distance_transform_edt(figure) <= max(1, round(LINE * height)) + 1
    gaps = []
    for region in regions:
        up, left, down, right = region.bbox
        centre = 0.5 * (up + down) - rows[0]
        if left <= axis < right and centre < MIDDLE * height:
            continue
        mask = paper == region.label
        if float(background.distance[mask].mean()) > PAPERLIKE * background.tolerance:
            continue
        rim = mask & ~ndimage.binary_erosion(mask)
        if float(shallow[rim].mean()) > CLOSED:  # a line alone: a sleeve, not the gap beside one
            continue
        gaps.append(
            Gap(mask, (0.5 * (left + right - 1) - axis) / height, centre / height, region.area / height**2)
        )
    return tuple(gaps)


def shared(first: Sequence[Gap], second: Sequence[Gap]) -> tuple[list[Gap], list[Gap]]:
    """Of the gaps of a view and of the opposite one, those that both have, at mirrored places and of about one size.

    An eye has no counterpart on the back of the head; a gap is seen from both sides.
    """
    pairs = [(one, other) for one in first for other in second if _are_one(one, other)]
    ours, theirs = [id(one) for one, _ in pairs], [id(other) for _, other in pairs]
    return [one for one in first if id(one) in ours], [one for one in second if id(one) in theirs]


def _are_one(one: Gap, other: Gap) -> bool:
    near = np.hypot(one.across + other.across, one.up - other.up) <= APART
    return bool(near) and 1.0 / ALIKE <= one.area / other.area <= ALIKE
