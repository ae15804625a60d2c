"""Cutting the figure out of its drawing: by its alpha, or from a plain background.

Letters: H, W of the drawing as read.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from skimage.color import rgb2lab
from skimage.measure import label

from charnerf.drawings.load import Drawing
from charnerf.errors import DataError
from charnerf.pictures import on_white

ALPHA_SHARE = 0.04  # of the pixels must be transparent for alpha to count (rounded corners do not)
RING = 0.02  # of the longer side: the border whose colours tell the background
MODE_TOLERANCE = 14.0  # CIELAB distance from the commonest border colour that still is background
PLAIN_SHARE = 0.4  # of the border must be of one colour for the background to count as plain
LEAST_TOLERANCE = 2.5  # CIELAB distance: just about seen
HALO_TOLERANCE = 6.0  # CIELAB distance; about what JPEG and resizing do to a flat colour beside an outline
HALO_WIDTH = {False: 3, True: 8}  # pixels that such a halo is wide, without and with lossy compression
SPECK_SHARE = 0.0005  # of the figure's area: smaller parts are noise
FILLED_SHARE = 0.95  # a figure that fills this share of the frame was not cut out


@dataclass(frozen=True)
class Cutout:
    """A figure without its background.

    Attributes:
        rgba: (H, W, 4), float32 in [0, 1], straight alpha; colours of the outline freed from the background.
        notes: What was done and what is doubtful, sentences.
    """

    rgba: np.ndarray
    notes: tuple[str, ...]


def cut_out(drawing: Drawing) -> Cutout:
    """Separate the figure from its background.

    Alpha is used where it carries information. Otherwise the background's colour is read off the border (with
    a slow gradient, as paper has), everything of that colour that is connected to the border goes, and the
    outline gets soft alpha. Regions of background colour that the figure encloses stay: they are more often
    white clothes than holes.

    Raises:
        DataError: If the border is not plain or no figure remains.
    """
    if has_alpha(drawing.rgba[..., 3]):
        rgba, notes = drawing.rgba.copy(), ["cut out by its alpha"]
        rgba[..., 3] *= _without_specks(rgba[..., 3] > 0.5, notes, margin=2)
    else:
        rgba, notes = _by_background(drawing)
    figure = rgba[..., 3] > 0.5
    share = float(figure.mean())
    if share < 0.002:
        raise DataError(
            f"{drawing.name}: found a figure of {100 * share:.2f} % of the picture, expected one that fills "
            "a good part of it. "
            "Its colours may be too near to the background's: save it with a transparent background."
        )
    touched = [name for name, line in _borders(figure).items() if line.any()]
    if touched and not has_alpha(drawing.rgba[..., 3]):
        notes.append(
            f"the figure touches the picture's {', '.join(touched)} edge: if it is cropped, draw it whole"
        )
    return Cutout(rgba, tuple(notes))


def has_alpha(alpha: np.ndarray) -> bool:
    """Whether alpha separates something: some of the picture is clear, some is not."""
    clear = float((alpha < 0.5).mean())
    return ALPHA_SHARE < clear < 1.0 - 1e-4


@dataclass(frozen=True)
class Background:
    """What of a drawing is plain background.

    Attributes:
        mask: Connected to the border and of its colour, (H, W) bool.
        distance: CIELAB distance of each pixel from the background's colour there, (H, W).
        tolerance: Distance up to which a pixel is of that colour.
        rgb: Its colour, (3,), in [0, 1].
    """

    mask: np.ndarray
    distance: np.ndarray
    tolerance: float
    rgb: np.ndarray


def find_background(drawing: Drawing) -> Background:
    """Find the plain background that a drawing's border shows.

    Raises:
        DataError: If the border is not plain.
    """
    rgb = on_white(drawing.rgba)
    lab = rgb2lab(rgb)
    ring = _ring(lab.shape[:2])
    inlier = _commonest(lab[ring])
    plain = float(inlier.mean())
    if plain < PLAIN_SHARE:
        raise DataError(
            f"{drawing.name}: found a border of which only {100 * plain:.0f} % is of one colour, expected a "
            "plain background or "
            "alpha. Paint the background in one colour, or save the figure with a transparent one."
        )
    background = _fit_background(lab, ring, inlier)
    distance = np.linalg.norm(lab - background, axis=-1)
    noise = np.percentile(distance[ring][inlier], 99.0)
    tolerance = float(np.clip(1.5 * noise, LEAST_TOLERANCE, MODE_TOLERANCE))
    regions = label(distance <= tolerance, connectivity=1)
    outside = np.unique(regions[ring & (regions > 0)])
    mask = np.isin(regions, outside[outside > 0])
    # a faint halo goes too, but only so far: light clothes must not leak away through a faint outline
    mask = ndimage.binary_dilation(
        mask,
        mask=mask | (distance <= max(tolerance, HALO_TOLERANCE)),
        iterations=HALO_WIDTH[drawing.lossy],
    )
    return Background(mask, distance, tolerance, np.median(rgb[ring][inlier], axis=0))


def _by_background(drawing: Drawing) -> tuple[np.ndarray, list[str]]:
    """Cut out a figure from the background that its border shows."""
    background = find_background(drawing)
    figure = ~background.mask
    color = (255 * background.rgb).round().astype(int)
    notes = [
        f"cut out from a background of about RGB {color[0]}, {color[1]}, {color[2]} (tolerance "
        f"{background.tolerance:.0f} in CIELAB)"
    ]
    if float(figure.mean()) > FILLED_SHARE:
        raise DataError(
            f"{drawing.name}: found no background (the figure would fill {100 * float(figure.mean()):.0f} % "
            "of the picture), "
            "expected a figure on a plain background. Leave a margin, or save it with a transparent "
            "background."
        )
    figure = _without_specks(figure, notes, margin=0)
    return _soft_outline(on_white(drawing.rgba), figure), notes


def _ring(shape: tuple[int, int]) -> np.ndarray:
    """The border's pixels, (H, W) bool."""
    width = max(1, round(RING * max(shape)))
    ring = np.ones(shape, bool)
    ring[width:-width, width:-width] = False
    return ring


def _commonest(colors: np.ndarray) -> np.ndarray:
    """Which of the colours (P, 3), CIELAB, belong to the commonest one, (P,) bool."""
    bins = np.round(colors / 6.0).astype(int)
    _, index, counts = np.unique(bins, axis=0, return_inverse=True, return_counts=True)
    mode = colors[index.reshape(-1) == counts.argmax()].mean(0)
    for _ in range(3):
        inlier = np.linalg.norm(colors - mode, axis=1) < MODE_TOLERANCE
        mode = colors[inlier].mean(0)
    return inlier


def _fit_background(lab: np.ndarray, ring: np.ndarray, inlier: np.ndarray) -> np.ndarray:
    """Background colour everywhere, (H, W, 3): a quadratic surface through the border's background pixels."""
    height, width = ring.shape
    y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
    terms = np.stack((np.ones_like(x), x, y, x * y, x * x, y * y), axis=-1)
    basis, colors = terms[ring], lab[ring]
    used = inlier
    for _ in range(2):  # the second time with the border pixels that a gradient had put out of reach
        weight, *_ = np.linalg.lstsq(
            np.concatenate((basis[used], 1e-2 * np.sqrt(used.sum()) * np.diag([0, 1, 1, 1, 1, 1]))),
            np.concatenate((colors[used], np.zeros((6, 3)))),
            rcond=None,
        )
        used = used | (np.linalg.norm(colors - basis @ weight, axis=1) < HALO_TOLERANCE)
    return terms @ weight


def _without_specks(figure: np.ndarray, notes: list[str], *, margin: int) -> np.ndarray:
    """Drop parts too small to belong to a figure.

    Args:
        figure: (H, W) bool.
        notes: Gets a sentence if anything was dropped.
        margin: Pixels around kept parts that are kept too, for soft outlines.

    Returns:
        (H, W) bool.
    """
    labels = label(figure, connectivity=2)
    areas = np.bincount(labels.reshape(-1))
    areas[0] = 0
    if len(areas) < 2:
        return figure
    kept = np.flatnonzero(areas >= max(2.0, SPECK_SHARE * areas.max()))
    dropped = int((areas > 0).sum()) - len(kept)
    if dropped:
        notes.append(f"{dropped} specks dropped, each below {100 * SPECK_SHARE:.2f} % of the figure")
    result = np.isin(labels, kept)
    return ndimage.binary_dilation(result, iterations=margin) if margin else result


def _soft_outline(rgb: np.ndarray, figure: np.ndarray) -> np.ndarray:
    """Alpha and pure colours along the outline, where pixels mix figure and background.

    A pixel near the outline is taken as a mix of the nearest colour well inside and the nearest background:
    its share of the former is its alpha, and it gets the former's colour.
    """
    alpha = figure.astype(np.float64)
    core = ndimage.binary_erosion(figure, iterations=2, border_value=1)
    wide = ndimage.binary_dilation(figure, iterations=1)
    band = wide & ~core
    if core.any() and not wide.all():
        inner = ndimage.distance_transform_edt(~core, return_distances=False, return_indices=True)
        outer = ndimage.distance_transform_edt(wide, return_distances=False, return_indices=True)
        mixed = rgb[band]
        front, back = rgb[tuple(i[band] for i in inner)], rgb[tuple(i[band] for i in outer)]
        span = front - back
        share = ((mixed - back) * span).sum(-1) / np.maximum((span * span).sum(-1), 1e-4)
        near = (
            ndimage.distance_transform_edt(~core)[band] < 4.0
        )  # thin parts have no inside: they stay as they are
        clear = (span * span).sum(-1) > 0.02
        alpha[band] = np.where(near & clear, share.clip(0.0, 1.0), alpha[band])
        part = near & clear & (share < 0.98)
        colors = rgb.copy()
        colors[band] = np.where(part[:, None], front, mixed)
        rgb = colors
    return np.concatenate((rgb, alpha[..., None]), axis=2).astype(np.float32)


def _borders(figure: np.ndarray) -> dict[str, np.ndarray]:
    return {"upper": figure[0], "lower": figure[-1], "left": figure[:, 0], "right": figure[:, -1]}
