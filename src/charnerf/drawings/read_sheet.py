"""A sheet to drawings by where they are seen from: what was taken for what, said in sentences and drawn in a picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage
from skimage.color import rgb2lab

from charnerf.drawings.align import on_one_scale
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import Drawing, drawing_from_array, load_drawing
from charnerf.drawings.naming import MOST_NAMED, looks_left, name_views
from charnerf.drawings.options import Segment
from charnerf.drawings.sheet import Sheet, find_figures
from charnerf.drawings.viewpoints import Viewpoint, between_square_ones, viewpoint
from charnerf.errors import DataError
from charnerf.pictures import bytes_on_white, to_bytes

CANVAS = 96  # pixels a side of the canvases that views are named on
ALIKE = 0.5  # overlap of the figures' colours below which they may be of two characters; of one it is 0.8 and more
ALIKE_HEIGHT = 0.83  # of the tallest figure: lower ones are lower than one hand draws on one page
PICTURE_SIDE = 1200  # pixels, at most
FIGURE, ASIDE = (220, 40, 40), (150, 150, 150)


@dataclass(frozen=True)
class SheetViews:
    """Drawings of a sheet.

    Attributes:
        drawings: RGBA (H, W, 4) by where they are seen from; front first, then sides, then back.
        sheet: What was found, figures in reading order.
        views: What each of these figures was taken for; None for one that is left out.
        assumptions: What was taken for what, sentences.
        warnings: What is doubtful, with what to type instead.
        picture: RGB uint8 (H, W, 3): the sheet with its figures numbered and named, and what was left aside.
    """

    drawings: dict[Viewpoint, np.ndarray]
    sheet: Sheet
    views: tuple[Viewpoint | None, ...]
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]
    picture: np.ndarray


def read_sheet(
    source: str | Path | np.ndarray,
    *,
    order: Sequence[str] = (),
    figures: Mapping[str, int] | None = None,
) -> SheetViews:
    """Take a sheet apart and name its views.

    Args:
        source: Picture file or array (H, W, 3 or 4).
        order: Names of the figures in reading order, such as front, side, back; `side` is left or right, whichever way
            it looks; `-` leaves a figure out. Empty: they are found.
        figures: Which figure shows a view, by its name, counted from 1 in reading order; instead of what was found.

    Raises:
        DataError: If there are fewer than two figures, more than can be named, or the names do not fit.
    """
    drawing = (
        load_drawing(source)
        if not isinstance(source, np.ndarray)
        else drawing_from_array(source, "the sheet")
    )
    sheet = find_figures(drawing)
    count = len(sheet.figures)
    if count < 2:
        raise DataError(
            f"{drawing.name}: found {'one' if count else 'no'} figure, expected a sheet with at least two views."
            " If it shows more, they touch, or their background is not of one colour. Crop it, and give views one by one: FRONT"
            " SIDE BACK, or --view 0=FRONT --view 90=SIDE."
        )
    canvases = canvases_to_name([one.drawing for one in sheet.figures])
    views, doubtful = _views(drawing, canvases, order, figures or {})
    chosen = [(view, index) for index, view in views.items() if view is not None]
    chosen.sort(key=lambda pair: pair[0].rank)
    return SheetViews(
        drawings={view: sheet.figures[index].drawing.rgba for view, index in chosen},
        sheet=sheet,
        views=tuple(views[index] for index in range(count)),
        assumptions=(
            f"{drawing.name}: {count} figures, from the left, row by row: "
            + ", ".join(f"{index + 1} {_name(view)}" for index, view in views.items())
            + ".",
            *([] if order or figures else _between(views)),
            *_asides(sheet),
        ),
        warnings=tuple(_warnings(drawing, sheet, canvases, chosen, doubtful)),
        picture=_picture(drawing, sheet, views),
    )


def canvases_to_name(drawings: Sequence[Drawing], segment: Segment | None = None) -> list[np.ndarray]:
    """Figures cut out and brought to one height, (CANVAS, CANVAS, 4) each, as `naming` wants them.

    Raises:
        DataError: If one can not be cut out.
    """
    cut = [cut_out(one, segment).rgba for one in drawings]
    return on_one_scale(cut, [one.name for one in drawings], CANVAS)


def _views(
    drawing: Drawing, canvases: Sequence[np.ndarray], order: Sequence[str], figures: Mapping[str, int]
) -> tuple[dict[int, Viewpoint | None], bool]:
    """View of each figure by its index, None for one that is left out; and whether that is doubtful."""
    count = len(canvases)
    naming = name_views(canvases) if not order and count <= MOST_NAMED else None
    if order and len(order) != count:
        raise DataError(
            f"--order: found {len(order)} names ({', '.join(order)}), expected one for each of the {count} figures of"
            f" {drawing.name}, in reading order; `-` leaves one out."
        )
    if naming is None and not order and len(figures) < 2:
        raise DataError(
            f"{drawing.name}: found {count} figures, expected at most {MOST_NAMED} to name by themselves. Say which is which:"
            f" --order {','.join(['front', 'side', 'back', *['-'] * (count - 3)])}, or --figure front=1 --figure back=3."
        )
    views: dict[int, Viewpoint | None] = dict.fromkeys(range(count))
    if order:
        shown = {name: canvases[i] for i, name in enumerate(order)}
        views |= {
            i: None if name == "-" else named_view(name, canvases[i], shown) for i, name in enumerate(order)
        }
        _check_once("--order", [view for view in views.values() if view is not None])
    elif naming is not None:
        views |= dict(enumerate(square_views(naming.viewpoints)))
    wanted: dict[int, Viewpoint] = {}
    for name, number in figures.items():
        if not 1 <= number <= count:
            raise DataError(f"--figure {name}={number}: found no such figure, expected 1 to {count}.")
        if number - 1 in wanted:
            raise DataError(
                f"--figure {name}={number}: found this figure given for {wanted[number - 1].name} too, expected another one for"
                " each view. Leave one out."
            )
        shown = {view.name: canvases[i] for i, view in views.items() if view is not None}
        wanted[number - 1] = named_view(name, canvases[number - 1], shown)
        views |= {i: None for i, view in views.items() if view == wanted[number - 1]} | {
            number - 1: wanted[number - 1]
        }
    _check_once("--figure", list(wanted.values()))
    return views, naming is not None and naming.is_doubtful and not figures


def _check_once(option: str, given: Sequence[Viewpoint]) -> None:
    """Refuse a view that is given twice, under whatever names."""
    for view in given:
        if given.count(view) > 1:
            raise DataError(
                f"{option}: found {view.name} for two figures, expected each view once. Leave one of them out, or say where it is"
                " seen from, such as 45 degrees."
            )


def square_views(viewpoints: Sequence[Viewpoint]) -> list[Viewpoint | None]:
    """The viewpoints, without those between them where front, back and a side are there: see `between_square_ones`."""
    left_out = between_square_ones(viewpoints)
    return [None if one in left_out else one for one in viewpoints]


def named_view(name: str, canvas: np.ndarray, shown: Mapping[str, np.ndarray]) -> Viewpoint:
    """A viewpoint by its name; `side` looks whichever way the figure does, by the front and back that are shown."""
    if name != "side":
        return viewpoint(name)
    return viewpoint("left" if looks_left(canvas, shown.get("front"), shown.get("back")) else "right")


def _between(views: Mapping[int, Viewpoint | None]) -> list[str]:
    """That figures between the square views were left out, and how to take one."""
    numbers = [str(index + 1) for index, view in views.items() if view is None]
    if not numbers:
        return []
    return [
        f"Left out, as seen from between front, side and back, which the weights were trained on: {', '.join(numbers)}"
        f" (--figure three-quarter-front={numbers[0]} takes it)."
    ]


def _name(view: Viewpoint | None) -> str:
    return "left out" if view is None else view.name


def _asides(sheet: Sheet) -> list[str]:
    """What was left aside, counted by reason."""
    reasons = [one.reason for one in sheet.left_aside]
    if not reasons:
        return []
    counts = ", ".join(f"{reason} ({reasons.count(reason)})" for reason in dict.fromkeys(reasons))
    return [f"Left aside: {counts}."]


def _warnings(
    drawing: Drawing,
    sheet: Sheet,
    canvases: Sequence[np.ndarray],
    chosen: Sequence[tuple[Viewpoint, int]],
    doubtful: bool,
) -> list[str]:
    lines = _unlike_heights(drawing, sheet, chosen)
    if doubtful:
        shown = _order(sheet, chosen)
        lines.append(
            f"{drawing.name}: which view is which is doubtful. If it is not {','.join(shown)}, say so: --order"
            f" {','.join(reversed(shown))}, say, or --figure back=1."
        )
    colors = {index: _histogram(canvases[index]) for _, index in chosen}
    first_view, first = chosen[0]
    for view, index in chosen[1:]:
        overlap = float(np.minimum(colors[first], colors[index]).sum())
        if overlap < ALIKE:
            lines.append(
                f"{drawing.name}: figure {index + 1} ({view.name}) shares {100 * overlap:.0f} % of its colours with figure"
                f" {first + 1} ({first_view.name}), expected {100 * ALIKE:.0f} % or more: are they of one character? Leave it"
                " out with `-` in --order if not."
            )
    return lines


def _order(sheet: Sheet, chosen: Sequence[tuple[Viewpoint, int]]) -> list[str]:
    """What --order says where these figures are taken and the others left out."""
    names = {index: view.name for view, index in chosen}
    return [names.get(index, "-") for index in range(len(sheet.figures))]


def _unlike_heights(drawing: Drawing, sheet: Sheet, chosen: Sequence[tuple[Viewpoint, int]]) -> list[str]:
    """Figures much lower than the tallest one: a sword beside its owner, or a figure of which a part was not found."""
    heights = {index: sheet.figures[index].box[3] - sheet.figures[index].box[1] for _, index in chosen}
    tallest = max(heights, key=lambda index: heights[index])
    return [
        f"{drawing.name}: figure {index + 1} ({view.name}) is {100 * heights[index] / heights[tallest]:.0f} % as tall as figure"
        f" {tallest + 1}, expected {100 * ALIKE_HEIGHT:.0f} % or more: is it a view of the character, and whole? If not, leave it"
        f" out by --order {','.join(_order(sheet, [one for one in chosen if one[1] != index]))}, or give the views one by one."
        for view, index in chosen
        if heights[index] < ALIKE_HEIGHT * heights[tallest]
    ]


def _histogram(canvas: np.ndarray) -> np.ndarray:
    """How often the figure's colours occur, smoothed, summing to 1."""
    lab = rgb2lab(canvas[..., :3])[canvas[..., 3] > 0.5]
    counts, _ = np.histogramdd(lab, bins=(10, 12, 12), range=((0, 100), (-60, 60), (-60, 60)))
    smooth = ndimage.gaussian_filter(counts, 1.0)
    return smooth / max(float(smooth.sum()), 1e-9)


def _picture(drawing: Drawing, sheet: Sheet, views: Mapping[int, Viewpoint | None]) -> np.ndarray:
    """The sheet with boxes: figures numbered and named, the rest in grey with why it was left aside."""
    page = Image.fromarray(bytes_on_white(to_bytes(drawing.rgba)))
    scale = min(1.0, PICTURE_SIDE / max(page.size))
    page = page.resize((max(1, round(page.width * scale)), max(1, round(page.height * scale))))
    draw, font = ImageDraw.Draw(page), ImageFont.load_default(size=14)
    for aside in sheet.left_aside:
        box = [scale * edge for edge in aside.box]
        draw.rectangle(box, outline=ASIDE)
        draw.text((box[0] + 2, box[1] + 1), aside.reason, fill=ASIDE, font=font)
    for index, figure in enumerate(sheet.figures):
        view = views.get(index)
        box = [scale * edge for edge in figure.box]
        draw.rectangle(box, outline=FIGURE, width=2)
        draw.text((box[0] + 4, box[1] + 3), f"{index + 1} {_name(view)}", fill=FIGURE, font=font)
    return np.asarray(page)
