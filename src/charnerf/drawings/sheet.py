"""A sheet with several figures of one character: where each is, and what beside them is none.

Letters: H, W of the sheet.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import ndimage
from skimage.measure import label, regionprops

from charnerf.drawings.background import find_background
from charnerf.drawings.cutout import SPECK_SHARE, has_alpha
from charnerf.drawings.load import Drawing
from charnerf.errors import DataError
from charnerf.wording import typed_or_clicked

MOST_FIGURES = 8
JOINED = 0.0015  # share of the sheet's longer side: parts nearer to each other than this hang together
BESIDE = 0.008  # share of it within which what is no figure belongs to one: a hand beyond a cuff of the paper's colour
LINE_LENGTH = (
    0.35  # share of the sheet's side beyond which a thin straight run is a construction line or a frame
)
LINE_WIDTH = 0.006
LINE_SHARE = 0.2  # of such a run that is thin: more than the few pixels of figures' edges that lie across
LEAST_HEIGHT = 0.5  # of the tallest candidate's: what is smaller is a detail, a swatch or text
ALIKE = 0.2  # relative difference of heights within which figures are drawn at one scale
SOLID = 0.93  # share of its box that a swatch or a frame fills
MARGIN = 0.06  # of a figure's height, around it


@dataclass(frozen=True)
class Figure:
    """One figure of a sheet.

    Attributes:
        box: Left, top, right and bottom, pixels of the sheet as worked with; edges.
        drawing: The figure alone with a margin of background; other figures' parts are painted over.
    """

    box: tuple[int, int, int, int]
    drawing: Drawing


@dataclass(frozen=True)
class LeftAside:
    """Something on a sheet that is no figure: its box as `Figure.box`, and what it was taken for."""

    box: tuple[int, int, int, int]
    reason: str


@dataclass(frozen=True)
class Sheet:
    """What was found on a sheet.

    Attributes:
        figures: In reading order: row by row, each from the left.
        left_aside: What was not taken for a figure.
    """

    figures: tuple[Figure, ...]
    left_aside: tuple[LeftAside, ...]


def find_figures(drawing: Drawing) -> Sheet:
    """Find the figures of a sheet, however many there are.

    Raises:
        DataError: If the background is not plain, nothing stands on it, or more than MOST_FIGURES figures do.
    """
    ink, lines = _ink(drawing)
    labels = label(
        ndimage.binary_dilation(ink, iterations=max(1, round(JOINED * max(ink.shape)))), connectivity=2
    )
    labels[~ink] = 0
    regions = [one for one in regionprops(labels) if one.area >= 1e-5 * ink.size]
    if not regions:
        raise DataError(
            f"{drawing.name}: found nothing on its background, expected figures of a character. Check the file."
        )
    chosen, reasons = _without_cut_off(regions, *_choose(regions), ink.shape)
    groups = _groups(regions, chosen, labels)
    chosen += _in_pieces(regions, chosen, groups, ink.shape)
    if len(chosen) > MOST_FIGURES:
        raise DataError(
            f"{drawing.name}: found {len(chosen)} figures, expected at most {MOST_FIGURES}: crop it to the views of one"
            f" character{typed_or_clicked(', or give them one by one with --view', '')}."
        )
    owners = _owners(regions, chosen, groups)
    order = _reading_order([regions[index].bbox for index in chosen])
    figures = []
    for number, place in enumerate(order, start=1):
        index = chosen[place]
        mine = np.isin(labels, [regions[i].label for i, owner in owners.items() if owner == index])
        named = replace(drawing, name=f"{drawing.name}, figure {number}")
        figures.append(_crop(named, mine, ink | lines))
    aside = [LeftAside(_box(regions[i].bbox), why) for i, why in reasons.items() if i not in owners]
    aside += [LeftAside(_box(one.bbox), "a line") for one in regionprops(label(lines, connectivity=2))]
    return Sheet(tuple(figures), tuple(aside))


def _ink(drawing: Drawing) -> tuple[np.ndarray, np.ndarray]:
    """What stands on the sheet's background, (H, W) bool, without long lines; and those lines."""
    if has_alpha(drawing.rgba[..., 3]):
        return _without_lines(drawing.rgba[..., 3] > 0.5)
    background = find_background(drawing)
    marked, lines = _without_lines(background.distance > background.tolerance)
    if not lines.any():
        return ~background.mask, lines
    # lines fence in what is background between figures: with them away it hangs together with the border's
    paper = label(~marked, connectivity=1)
    border = np.unique(np.concatenate((paper[0], paper[-1], paper[:, 0], paper[:, -1])))
    ink = ~(background.mask | np.isin(paper, border[border > 0]))
    return ndimage.binary_opening(ink), lines


def _without_lines(ink: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ink without long thin straight lines, and those lines."""
    lines = np.zeros_like(ink)
    thickest = max(2, round(LINE_WIDTH * max(ink.shape)))
    for axis in (0, 1):
        along = ink if axis else ink.T
        thin = _thin_runs(along, max(8, round(LINE_LENGTH * along.shape[1])), thickest)
        lines |= thin if axis else thin.T
    return ink & ~lines, lines


def _thin_runs(mask: np.ndarray, length: int, thickest: int) -> np.ndarray:
    """Thin pixels of a mask's straight horizontal lines of at least a length; gaps of two pixels (JPEG noise) do not end one."""
    closed = ndimage.binary_closing(mask, structure=np.ones((1, 3), dtype=bool))
    thick = ndimage.binary_opening(mask, structure=np.ones((thickest + 1, 1), dtype=bool))
    thin = mask & ~thick
    runs = np.zeros_like(mask)
    for row in np.flatnonzero(closed.sum(axis=1) >= length):
        edges = np.flatnonzero(np.diff(np.concatenate(([0], closed[row].astype(np.int8), [0]))))
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            count = thin[row, start:end].sum()
            if end - start < length or count < LINE_SHARE * (end - start):
                continue
            if count >= length or _goes_through(thick[row, start:end], thickest):
                runs[row, start:end] = True
    return runs & thin


def _goes_through(thick: np.ndarray, least: int) -> bool:
    """Whether a run, thick (L,) bool where it crosses something, comes out of it at both ends: an antenna ends in its figure."""
    crossed = np.flatnonzero(thick)
    return not len(crossed) or min(crossed[0], len(thick) - 1 - crossed[-1]) > least


def _choose(regions: Sequence[Any]) -> tuple[list[int], dict[int, str]]:
    """Indices of the regions that are figures, and why the others are none."""
    heights = np.array([one.bbox[2] - one.bbox[0] for one in regions], dtype=np.float64)
    reasons: dict[int, str] = {}
    candidates = []
    for index, region in enumerate(regions):
        height, width = heights[index], region.bbox[3] - region.bbox[1]
        if region.area >= SOLID * height * width:
            reasons[index] = "a swatch or a panel"
        else:
            candidates.append(index)
    if not candidates:
        return [], reasons
    best: list[int] = []
    for reference in candidates:
        alike = [i for i in candidates if abs(heights[i] - heights[reference]) <= ALIKE * heights[reference]]
        weight = len(alike) * heights[reference]  # many, and tall: text is many too
        if not best or weight > len(best) * np.median(heights[best]):
            best = alike if heights[reference] >= LEAST_HEIGHT * heights[candidates].max() else best
    for index in candidates:
        if index not in best:
            smaller = heights[index] < np.median(heights[best]) if best else True
            reasons[index] = "a detail or text" if smaller else "a close-up"
    return best, reasons


def _without_cut_off(
    regions: Sequence[Any], chosen: list[int], reasons: dict[int, str], shape: tuple[int, ...]
) -> tuple[list[int], dict[int, str]]:
    """Figures that the sheet's border cuts off are none, where at least two whole ones stay."""
    height, width = shape[:2]
    boxes = {i: regions[i].bbox for i in chosen}
    cut = [
        i
        for i, (top, left, down, right) in boxes.items()
        if not (top and left and down < height and right < width)
    ]
    if not cut or len(chosen) - len(cut) < 2:
        return chosen, reasons
    return [i for i in chosen if i not in cut], reasons | dict.fromkeys(cut, "cut off by the border")


def _groups(regions: Sequence[Any], chosen: Sequence[int], labels: np.ndarray) -> dict[int, int]:
    """Number of the group of each region that is no speck: what is next to each other, or next to that, is one group."""
    least = SPECK_SHARE * min((regions[index].area for index in chosen), default=0.0)
    parts = [index for index, one in enumerate(regions) if one.area >= least]
    drawn = np.isin(labels, [regions[index].label for index in parts])
    groups = label(ndimage.distance_transform_edt(~drawn) <= 0.5 * BESIDE * max(labels.shape), connectivity=2)
    return {index: int(groups[tuple(regions[index].coords[0])]) for index in parts}


def _in_pieces(
    regions: Sequence[Any], chosen: Sequence[int], groups: Mapping[int, int], shape: tuple[int, ...]
) -> list[int]:
    """The largest pieces of figures that fell apart, as at a beard of the paper's colour: whole groups as tall as the chosen."""
    if not chosen:
        return []
    usual = float(np.median([regions[index].bbox[2] - regions[index].bbox[0] for index in chosen]))
    found = []
    for group in sorted(set(groups.values()) - {groups[index] for index in chosen}):
        members = [index for index, number in groups.items() if number == group]
        boxes = np.array([regions[index].bbox for index in members])
        (top, left), (down, right) = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
        is_whole = top and left and down < shape[0] and right < shape[1]
        if len(members) > 1 and is_whole and abs(down - top - usual) <= ALIKE * usual:
            found.append(max(members, key=lambda index: regions[index].area))
    return found


def _owners(regions: Sequence[Any], chosen: Sequence[int], groups: Mapping[int, int]) -> dict[int, int]:
    """Which figure each region belongs to, but for specks: small loose parts within a figure's box are its, and so is its group."""
    owners = {index: index for index in chosen}
    for index, group in groups.items():
        row, column = regions[index].centroid
        boxes = {figure: regions[figure].bbox for figure in chosen}
        within = [i for i, box in boxes.items() if box[0] <= row <= box[2] and box[1] <= column <= box[3]]
        near = within or [i for i in chosen if groups[i] == group]
        if near:
            nearest = min(near, key=lambda i: _apart(boxes[i], regions[index].bbox))
            owners.setdefault(index, nearest)
    return owners


def _apart(one: tuple[int, int, int, int], other: tuple[int, int, int, int]) -> int:
    """Pixels between two boxes (top, left, bottom, right); 0 or less where they overlap."""
    return max(one[0] - other[2], other[0] - one[2], one[1] - other[3], other[1] - one[3])


def _reading_order(boxes: Sequence[tuple[int, int, int, int]]) -> list[int]:
    """Row by row, each from the left: figures whose heights overlap by half stand in one row."""
    rows: list[list[int]] = []
    for index in sorted(range(len(boxes)), key=lambda i: boxes[i][0]):
        top, bottom = boxes[index][0], boxes[index][2]
        for row in rows:
            first = boxes[row[0]]
            if min(bottom, first[2]) - max(top, first[0]) > 0.5 * (bottom - top):
                row.append(index)
                break
        else:
            rows.append([index])
    return [index for row in rows for index in sorted(row, key=lambda i: boxes[i][1])]


def _crop(drawing: Drawing, mine: np.ndarray, ink: np.ndarray) -> Figure:
    """A figure with a margin; the ink of others is painted over with the nearest background."""
    rows, columns = np.flatnonzero(mine.any(axis=1)), np.flatnonzero(mine.any(axis=0))
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    room = max(4, round(MARGIN * (bottom - top)))
    window = (
        slice(max(0, top - room), min(mine.shape[0], bottom + room)),
        slice(max(0, left - room), min(mine.shape[1], right + room)),
    )
    rgba = drawing.rgba[window].copy()
    others = ndimage.binary_dilation(ink[window] & ~mine[window], iterations=3)
    others &= ~ndimage.binary_dilation(mine[window], iterations=2)
    ground = ~ndimage.binary_dilation(ink[window], iterations=3)
    if others.any() and ground.any():
        nearest = ndimage.distance_transform_edt(~ground, return_distances=False, return_indices=True)
        rgba[others] = rgba[tuple(axis[others] for axis in nearest)]
    box = (int(left), int(top), int(right), int(bottom))
    alone = replace(drawing, rgba=rgba, size=(rgba.shape[1], rgba.shape[0]))
    return Figure(box, alone)


def _box(bbox: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of scikit-image's top, left, bottom, right."""
    top, left, bottom, right = bbox
    return left, top, right, bottom
