"""What stands beside a figure in its picture and is none of it: a frame, a scanner's edge, a shadow on the ground, a second figure.

Letters: H, W of the drawing as read.
"""

from dataclasses import replace

import numpy as np
from scipy import ndimage
from skimage.color import rgb2lab
from skimage.measure import label, regionprops

from charnerf.drawings.load import Drawing

FRAME_SPAN = 0.85  # share of the picture's sides that a frame spans
FRAME_AREA = 0.2  # share of its box that a frame covers at most
EDGE_SPAN = 0.6  # share of a side that a scanner's edge runs along
EDGE_WIDTH = 0.06  # share of the other side that it is wide at most
GROUND = 0.75  # share of a figure's height below which a shadow may lie
FLATNESS = 2.0  # a shadow is at least so many times as wide as it is high
BEYOND = 0.06  # share of the figure's height by which a shadow reaches beside the feet
DARKENED = (0.25, 0.985)  # brightness of a shadow, by the paper's
HUE = 5.0  # CIELAB distance of a shadow's hue from the paper's, darkened alike
OPAQUE = 0.93  # alpha from which a pixel is paint
SHADOW_TONE = (45.0, 12.0)  # CIELAB: lightest and most colourful that a shadow saved by its alpha is
CUT_OPAQUE = 0.98  # alpha of a cut through a figure
CUT_SHARE = 0.6  # of a contact with the border that is so opaque where the figure is cut off
CUT_WIDTH = 0.01  # of the figure's height: shorter contacts say nothing
SOFT = 0.3  # translucent pixels per pixel of outline of a figure that was saved with a soft one
ALIKE_HEIGHT, ALIKE_WIDTH = 0.7, 0.3  # shares of the largest part's that another whole figure has


def frame_window(ink: np.ndarray) -> tuple[slice, slice] | None:
    """Rows and columns inside a frame around the picture, or beside a scanner's edge; None where there is neither.

    Args:
        ink: What is clearly not background, (H, W) bool; paper inside a frame is none.
    """
    height, width = ink.shape
    top, bottom, left, right = 0, height, 0, width
    for part in regionprops(label(ink, connectivity=2)):
        up, start, down, end = part.bbox
        tall, wide = down - up, end - start
        if tall >= FRAME_SPAN * height and wide >= FRAME_SPAN * width and _is_frame(part.image):
            inside = ndimage.binary_fill_holes(part.image) & ~part.image
            holes = regionprops(label(inside))
            if holes:
                hole = max(holes, key=lambda one: one.area).bbox
                top, left = max(top, up + hole[0]), max(left, start + hole[1])
                bottom, right = min(bottom, up + hole[2]), min(right, start + hole[3])
        elif tall >= EDGE_SPAN * height and wide <= EDGE_WIDTH * width and (start == 0 or end == width):
            left, right = (max(left, end), right) if start == 0 else (left, min(right, start))
        elif wide >= EDGE_SPAN * width and tall <= EDGE_WIDTH * height and (up == 0 or down == height):
            top, bottom = (max(top, down), bottom) if up == 0 else (top, min(bottom, up))
    if (top, bottom, left, right) == (0, height, 0, width):
        return None
    return slice(top + 1, bottom - 1), slice(left + 1, right - 1)


def _is_frame(part: np.ndarray) -> bool:
    """Whether a part (h, w) bool, in its box, is lines along all four of the box's sides and little else."""
    if part.mean() > FRAME_AREA:
        return False
    depth = max(1, round(EDGE_WIDTH * min(part.shape)))
    sides = (part[:depth].any(0), part[-depth:].any(0), part[:, :depth].any(1), part[:, -depth:].any(1))
    return all(side.mean() >= FRAME_SPAN for side in sides)


def cropped(drawing: Drawing, window: tuple[slice, slice]) -> Drawing:
    """A drawing's window; it keeps its name and the file's size."""
    return replace(drawing, rgba=np.ascontiguousarray(drawing.rgba[window]))


def shadow_on_paper(lab: np.ndarray, paper: np.ndarray, figure: np.ndarray) -> np.ndarray:
    """A shadow on the ground of a figure that was cut out of its paper, (H, W) bool.

    It has the paper's hue but darker, lies at the feet, is flat, and reaches beside them.

    Args:
        lab: The picture, CIELAB, (H, W, 3).
        paper: Its background everywhere, (H, W, 3).
        figure: What is not background, (H, W) bool.
    """
    share = lab[..., 0] / np.maximum(paper[..., 0], 1e-3)
    hue = np.linalg.norm(lab[..., 1:] - paper[..., 1:] * share[..., None], axis=-1)
    return _on_the_ground(figure & (share > DARKENED[0]) & (share < DARKENED[1]) & (hue < HUE), figure)


def shadow_by_alpha(rgba: np.ndarray) -> np.ndarray:
    """A shadow on the ground of a figure that was saved with its alpha, (H, W) bool: dark and translucent."""
    alpha = rgba[..., 3]
    lab = rgb2lab(rgba[..., :3])
    dark = (lab[..., 0] < SHADOW_TONE[0]) & (np.linalg.norm(lab[..., 1:], axis=-1) < SHADOW_TONE[1])
    clear = dark & (alpha > 0.0) & (alpha < OPAQUE)
    paint = ndimage.binary_dilation(alpha >= OPAQUE)  # whose outline is translucent too
    return _on_the_ground(clear & ~paint, alpha > 0.0)


def _on_the_ground(candidates: np.ndarray, figure: np.ndarray) -> np.ndarray:
    """Parts of candidates (H, W) that lie as shadows do."""
    rows = np.flatnonzero(figure.any(axis=1))
    shadow = np.zeros_like(figure)
    if not len(rows):
        return shadow
    height = rows[-1] + 1 - rows[0]
    candidates = candidates.copy()
    candidates[: int(rows[0] + GROUND * height)] = False
    solid = ndimage.binary_opening(candidates, iterations=1)
    labels = label(ndimage.binary_dilation(solid, iterations=3) & candidates | solid, connectivity=2)
    for part in regionprops(labels):
        up, start, down, end = part.bbox
        feet = figure[up:down] & (labels[up:down] != part.label)
        columns = np.flatnonzero(feet.any(axis=0))
        beside = end - start if not len(columns) else max(columns[0] - start, end - columns[-1] - 1)
        if end - start >= FLATNESS * (down - up) and beside >= BEYOND * height:
            shadow |= labels == part.label
    return shadow


def cut_edges(alpha: np.ndarray) -> list[str]:
    """Edges of a picture (H, W) that cut its figure off.

    The soft outline of a whole figure, cropped ever so tightly, is translucent there; a cut through it is opaque. None where
    outlines are hard, as in pixel art: those say nothing.
    """
    figure = alpha > 0.5
    rows = np.flatnonzero(figure.any(axis=1))
    outline = figure & ~ndimage.binary_erosion(figure, border_value=1)
    soft = ndimage.binary_dilation(outline) & (alpha > 1.0 - CUT_OPAQUE) & (alpha < CUT_OPAQUE)
    if soft.sum() <= SOFT * outline.sum():
        return []
    least = CUT_WIDTH * (rows[-1] + 1 - rows[0])
    borders = {"upper": alpha[0], "lower": alpha[-1], "left": alpha[:, 0], "right": alpha[:, -1]}
    found = []
    for name, line in borders.items():
        contacts, count = ndimage.label(line > 0.5)
        runs = [line[contacts == number] for number in range(1, count + 1)]
        if any(len(run) >= least and (run > CUT_OPAQUE).mean() >= CUT_SHARE for run in runs):
            found.append(name)
    return found


def count_figures(figure: np.ndarray) -> int:
    """How many figures of one size stand side by side in (H, W) bool: more than one make a sheet."""
    parts = regionprops(label(figure, connectivity=2))
    if not parts:
        return 0
    largest = max(parts, key=lambda one: one.area).bbox
    tall, wide = largest[2] - largest[0], largest[3] - largest[1]
    return sum(
        one.bbox[2] - one.bbox[0] >= ALIKE_HEIGHT * tall and one.bbox[3] - one.bbox[1] >= ALIKE_WIDTH * wide
        for one in parts
    )
