"""A side view guessed for drawings that have none: without one little bounds the depth, and the figure is a fog.

Each row is taken for an ellipse: as wide as the front shows it, as deep as a three-quarter view says, else in proportion.

Letters: H, W of the pictures; V views.
"""

from collections.abc import Mapping

import numpy as np
from scipy import ndimage

from charnerf.drawings.align import on_one_scale
from charnerf.drawings.viewpoints import Viewpoint, is_turned, side_missing
from charnerf.reconciling import reconcile

SIDE = 512  # pixels of a guess
ROUNDNESS = 0.9  # depth over width where no three-quarter view tells it
LEAST, MOST = 0.55, 1.3  # depth over width at the least and most
WIDE = 80.0  # percentile of rows' widths beyond which a row shows arms held out, which are no deeper than a trunk
EVEN = 0.02  # of the height: depths are smoothed by so much


def missing_side(drawn: Mapping[Viewpoint, np.ndarray]) -> tuple[Viewpoint, np.ndarray] | None:
    """Guess the side that is missing.

    Args:
        drawn: Figures RGBA (H, W, 4), of any size, by where they are seen from.

    Returns:
        Which side, and the guess, (SIDE, SIDE, 4); None where none is missing: `viewpoints.side_missing`.

    Raises:
        DataError: If one is no figure, or too small.
    """
    side = side_missing(list(drawn))
    if side is None:
        return None
    canvases = on_one_scale(list(drawn.values()), [view.name for view in drawn], SIDE)
    views = {view.azimuth_deg: canvas for view, canvas in zip(drawn, canvases, strict=True)}
    ruling = next(azimuth for azimuth in views if not is_turned(azimuth))
    between = next((azimuth for azimuth in views if is_turned(azimuth)), None)
    if between is not None:  # its rows at the heights of the ruling view's
        pair = (views[ruling], views[between])
        views[between] = reconcile(pair, (ruling, between)).apply(pair)[1]
    return side, guessed_side(views, side.azimuth_deg)


def guessed_side(views: Mapping[float, np.ndarray], azimuth_deg: float) -> np.ndarray:
    """Guess what a view from a side shows.

    Args:
        views: RGBA (H, W, 4) by azimuth, degrees: straight alpha, level, on one scale and floor line; a front or a back,
            and at most one view between.
        azimuth_deg: 90 for the left side, 270 for the right one.

    Returns:
        (H, W, 4) float32: rows of ellipses around the picture's middle, coloured by the view that sees each place best.
    """
    spans = {azimuth: _widest_runs(picture[..., 3] > 0.5) for azimuth, picture in views.items()}
    depth = _half_depths(spans)
    height, width = next(iter(views.values())).shape[:2]
    across = np.arange(width) + 0.5 - 0.5 * width
    turned = np.arcsin(np.clip(across / np.maximum(depth, 0.5)[:, None], -1.0, 1.0))
    best, color = np.full((height, width), -2.0), np.zeros((height, width, 3), np.float32)
    for azimuth, picture in views.items():
        angle = np.radians(azimuth_deg - azimuth) + turned
        start, end = spans[azimuth]
        column = start[:, None] + 0.5 * (1.0 + np.sin(angle)) * (end - start)[:, None]
        column = column.astype(int).clip(0, width - 1)
        facing = np.where((end > start)[:, None], np.cos(angle), -2.0)
        color = np.where(
            (facing > best)[..., None], np.take_along_axis(picture[..., :3], column[..., None], 1), color
        )
        best = np.maximum(best, facing)
    alpha = np.clip(depth[:, None] - np.abs(across) + 0.5, 0.0, 1.0) * (depth > 0.0)[:, None]
    return np.concatenate((color, alpha[..., None]), axis=-1).astype(np.float32)


def _half_depths(spans: Mapping[float, tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Half the depth of each row, (H,), pixels; 0 where nothing is."""
    widths = {azimuth: end - start for azimuth, (start, end) in spans.items()}
    facing = min(widths, key=lambda one: abs(np.sin(np.radians(one))))
    rows = widths[facing] > 0
    width = 0.5 * _trunk(widths[facing])
    depth = ROUNDNESS * width
    for azimuth, run in widths.items():
        sine = np.sin(np.radians(azimuth))
        if is_turned(azimuth):
            seen = np.where(run > 0, 0.5 * _trunk(run), width)
            squared = (seen**2 - (1.0 - sine**2) * width**2) / sine**2
            depth = np.sqrt(np.clip(squared, (LEAST * width) ** 2, (MOST * width) ** 2))
    even = EVEN * rows.sum()
    weights = ndimage.gaussian_filter1d(rows.astype(np.float64), even)
    smooth = ndimage.gaussian_filter1d(depth * rows, even) / np.maximum(weights, 1e-9)
    return np.where(rows, smooth, 0.0)


def _trunk(widths: np.ndarray) -> np.ndarray:
    """Widths of rows (H,), of wide ones no more than a trunk has."""
    return np.minimum(widths, np.percentile(widths[widths > 0], WIDE)) if widths.any() else widths


def _widest_runs(figure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First column of each row's widest run of a figure (H, W) bool, and the one after its last; both 0 without one."""
    starts, ends = np.zeros(len(figure), dtype=int), np.zeros(len(figure), dtype=int)
    for row in np.flatnonzero(figure.any(axis=1)):
        edges = np.flatnonzero(np.diff(np.concatenate(([False], figure[row], [False])).astype(np.int8)))
        widest = int((edges[1::2] - edges[::2]).argmax())
        starts[row], ends[row] = edges[::2][widest], edges[1::2][widest]
    return starts, ends
