"""What of a drawing is paper: one colour with slow gradients, or the checkerboard by which programs show transparency.

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
from charnerf.wording import typed_or_clicked

RING = 0.02  # of the longer side: the border whose colours tell the background
MODE_TOLERANCE = 14.0  # CIELAB distance from the commonest border colour that still is background
PLAIN_SHARE = 0.4  # of the border must be of one colour for the background to count as plain
LEAST_TOLERANCE = 2.5  # CIELAB distance: just about seen
HALO_TOLERANCE = 6.0  # CIELAB distance; about what JPEG and resizing do to a flat colour beside an outline
HALO_WIDTH = {False: 3, True: 8}  # pixels that such a halo is wide, without and with lossy compression
RINGING = 0.12  # of the contrast of an edge, which compression leaves beside it
BLOCK = 8  # pixels: as far as that reaches
BLEEDING = 0.3  # of the colourfulness beside it, which compression leaves in paper that is as light as ever
COLOR_BLOCK = 16  # pixels: as far as that reaches, since colour is stored at half the size
GREY = 4.0  # CIELAB chroma up to which a cell of a checkerboard is grey
CELLS = 5  # cells along a border, at least, that make a checkerboard
REGULAR = 0.95  # share of the border's pixels that must lie as the checkerboard says


@dataclass(frozen=True)
class Background:
    """What of a drawing is plain background.

    Attributes:
        mask: Connected to the border and of its colour, (H, W) bool.
        distance: CIELAB distance of each pixel from the background's colour there, (H, W).
        tolerance: Distance up to which a pixel is of that colour.
        rgb: Its colour, (3,), in [0, 1].
        paper: Its colour everywhere, (H, W, 3), CIELAB.
        lab: The drawing on white, (H, W, 3), CIELAB.
        is_checkered: Whether it is the checkerboard by which programs show transparency, drawn.
    """

    mask: np.ndarray
    distance: np.ndarray
    tolerance: float
    rgb: np.ndarray
    paper: np.ndarray
    lab: np.ndarray
    is_checkered: bool


def find_background(drawing: Drawing) -> Background:
    """Find the background that a drawing's border shows: of one colour, with slow gradients, or a drawn checkerboard.

    Raises:
        DataError: If the border is neither.
    """
    rgb = on_white(drawing.rgba)
    lab = rgb2lab(rgb)
    ring = _ring(lab.shape[:2])
    checkers = find_checkerboard(lab)
    if checkers is None:
        inlier = _commonest(lab[ring])
        plain = float(inlier.mean())
        if plain < PLAIN_SHARE:
            raise DataError(
                f"{drawing.name}: found a border of which only {100 * plain:.0f} % is of one colour, expected a "
                "plain background or "
                "alpha. Paint the background in one colour, save the figure with a transparent one, or "
                + typed_or_clicked(
                    "take --segmenter rembg.",
                    "set Background to a network (Options, Drawings) and add it again.",
                )
            )
        paper = _fit_background(lab, ring, inlier)
        distance = np.linalg.norm(lab - paper, axis=-1)
    else:
        inlier, paper = np.ones(int(ring.sum()), bool), checkers
        distance = np.linalg.norm(lab - paper, axis=-1)
        distance[_near_changes(checkers)] *= 0.25  # where cells meet, their colours may be mixed
    most, nearly_all = np.percentile(distance[ring][inlier], (95.0, 99.0))
    # a few pixels far off are text or a swatch, no noise of the paper
    noise = min(2.0 * most, 1.5 * nearly_all)
    tolerance = float(np.clip(noise, LEAST_TOLERANCE, MODE_TOLERANCE))
    return Background(
        mask=_connected(
            _near(distance, lab - paper, tolerance, lossy=drawing.lossy),
            distance,
            tolerance,
            ring,
            lossy=drawing.lossy,
        ),
        distance=distance,
        tolerance=tolerance,
        rgb=np.median(rgb[ring][inlier], axis=0),
        paper=paper,
        lab=lab,
        is_checkered=checkers is not None,
    )


def _near(distance: np.ndarray, offset: np.ndarray, tolerance: float, *, lossy: bool) -> np.ndarray:
    """What is near enough to the background's colour, by its distance (H, W) and its offset (H, W, 3) from that, (H, W) bool."""
    near = distance <= tolerance
    if lossy:  # beside strong edges compression rings, by a share of their contrast; farther off it does in colour alone
        near |= distance <= RINGING * ndimage.maximum_filter(distance, 2 * BLOCK + 1)
        chroma = np.linalg.norm(offset[..., 1:], axis=-1)
        bled = chroma <= BLEEDING * ndimage.maximum_filter(chroma, 2 * COLOR_BLOCK + 1)
        near |= bled & (np.abs(offset[..., 0]) <= LEAST_TOLERANCE)
    return near


def _connected(
    near: np.ndarray, distance: np.ndarray, tolerance: float, ring: np.ndarray, *, lossy: bool
) -> np.ndarray:
    """What is near (H, W) bool to the background's colour and connected to the border, and its halo, (H, W) bool."""
    regions = label(near, connectivity=1)
    outside = np.unique(regions[ring & (regions > 0)])
    mask = np.isin(regions, outside[outside > 0])
    # a faint halo goes too, but only so far: light clothes must not leak away through a faint outline
    return ndimage.binary_dilation(
        mask,
        mask=mask | (distance <= max(tolerance, HALO_TOLERANCE)),
        iterations=HALO_WIDTH[lossy],
    )


def find_checkerboard(lab: np.ndarray) -> np.ndarray | None:
    """The checkerboard (H, W, 3) of two greys that a picture's border shows, CIELAB; None where it shows none."""
    height, width = lab.shape[:2]
    edges = (lab[1], lab[-2], lab[:, 1], lab[:, -2])
    values = np.concatenate([edge[:, 0] for edge in edges])
    chroma = np.concatenate([np.linalg.norm(edge[:, 1:], axis=1) for edge in edges])
    middle = 0.5 * (np.percentile(values, 10.0) + np.percentile(values, 90.0))
    light = values > middle
    if (chroma > GREY).mean() > 1.0 - REGULAR or not 0.3 < light.mean() < 0.7:
        return None
    across, down = _changes(lab[1, :, 0] > middle), _changes(lab[:, 1, 0] > middle)
    if across is None or down is None or not 0.8 < across[1] / down[1] < 1.25:
        return None
    column = np.floor((np.arange(width) - across[0]) / across[1]).astype(int)
    row = np.floor((np.arange(height) - down[0]) / down[1]).astype(int)
    odd = (row[:, None] + column[None]) % 2 == 1
    is_light = lab[..., 0] > middle
    ring = _ring((height, width))
    agrees = float((is_light == odd)[ring].mean())
    if max(agrees, 1.0 - agrees) < REGULAR:
        return None
    odd = odd if agrees > 0.5 else ~odd
    colors = [np.median(lab[ring & (odd == one)], axis=0) for one in (False, True)]
    return np.where(odd[..., None], colors[1], colors[0])


def _changes(line: np.ndarray) -> tuple[float, float] | None:
    """Where a line of equal cells (N,) bool first changes and how wide a cell is, pixels; None where cells are unequal."""
    at = np.flatnonzero(np.diff(line.astype(np.int8)))
    if len(at) < CELLS:
        return None
    widths = np.diff(at)
    period = float((at[-1] - at[0]) / (len(at) - 1))
    if period < 2.0 or np.abs(widths - period).max() > max(1.5, 0.15 * period):
        return None
    return float(at[0]) + 1.0, period


def _near_changes(checkers: np.ndarray) -> np.ndarray:
    """Pixels (H, W) bool beside another cell of a checkerboard."""
    light = checkers[..., 0] > checkers[..., 0].mean()
    return ndimage.binary_dilation(light, iterations=1) & ndimage.binary_dilation(~light, iterations=1)


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
