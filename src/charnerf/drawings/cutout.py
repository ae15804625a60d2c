"""Cutting the figure out of its drawing: by its alpha, or from a plain background.

Letters: H, W of the drawing as read.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from skimage.measure import label

from charnerf.drawings.background import Background, find_background
from charnerf.drawings.enclosed import Gap, find_gaps
from charnerf.drawings.load import Drawing
from charnerf.drawings.options import Segment
from charnerf.drawings.surroundings import (
    count_figures,
    cropped,
    frame_window,
    shadow_by_alpha,
    shadow_on_paper,
)
from charnerf.errors import DataError
from charnerf.pictures import on_white
from charnerf.wording import typed_or_clicked

ALPHA_SHARE = 0.04  # of the pixels must be transparent for alpha to count (rounded corners do not)
SPECK_SHARE = 0.0005  # of the figure's area: smaller parts are noise
FRAME_CONTRAST = 20.0  # CIELAB distance from the paper of what may be a frame
SHADOW_NOTE = "a shadow on the ground was left out"
FILLED_SHARE = 0.95  # a figure that fills this share of the frame was not cut out


@dataclass(frozen=True)
class Cutout:
    """A figure without its background.

    Attributes:
        rgba: (H, W, 4), float32 in [0, 1], straight alpha; colours of the outline freed from the background.
        notes: What was done and what is doubtful, sentences.
        drawn: The drawing on white as it was cut out of its paper, (H, W, 3); None where its alpha did that.
        gaps: Regions of paper that the figure encloses, which may be seen through.
    """

    rgba: np.ndarray
    notes: tuple[str, ...]
    drawn: np.ndarray | None = None
    gaps: tuple[Gap, ...] = ()


def cut_out(drawing: Drawing, segment: Segment | None = None) -> Cutout:
    """Separate the figure from its background.

    Alpha is used where it carries information. Otherwise the background's colour is read off the border (with
    a slow gradient, as paper has), everything of that colour that is connected to the border goes, and the
    outline gets soft alpha. A frame around the picture and a shadow on the ground go too. Regions of background
    colour that the figure encloses stay, and are listed: whether they are gaps, another view tells (`see_through`).

    Args:
        drawing: One figure.
        segment: Tells the figure of a drawing without alpha from what lies behind it; None: the background's colour does.

    Raises:
        DataError: If the border is not plain, no figure remains, or several of one size do.
    """
    if has_alpha(drawing.rgba[..., 3]):
        cutout = _by_alpha(drawing)
    elif segment is None:
        cutout = _by_background(drawing)
    else:
        notes = ["cut out by a network"]
        mask = _without_specks(segment(drawing) > 0.5, notes, margin=0)
        cutout = Cutout(_soft_outline(on_white(drawing.rgba), mask), tuple(notes))
    figure = cutout.rgba[..., 3] > 0.5
    _check_figure(figure, drawing.name)
    touched = [name for name, line in _borders(figure).items() if line.any()]
    if not touched or has_alpha(drawing.rgba[..., 3]):
        return cutout
    note = f"the figure touches the picture's {', '.join(touched)} edge: if it is cropped, draw it whole"
    return replace(cutout, notes=(*cutout.notes, note))


def see_through(cutout: Cutout, gaps: Sequence[Gap]) -> Cutout:
    """A figure whose gaps are clear, with soft outlines around them; as it is without any."""
    if cutout.drawn is None or not gaps:
        return cutout
    open_ = np.any([gap.mask for gap in gaps], axis=0)
    note = f"{len(gaps)} enclosed {'gap' if len(gaps) == 1 else 'gaps'} of paper seen through"
    figure = (cutout.rgba[..., 3] > 0.5) & ~open_
    return replace(cutout, rgba=_soft_outline(cutout.drawn, figure), notes=(*cutout.notes, note))


def has_alpha(alpha: np.ndarray) -> bool:
    """Whether alpha separates something: some of the picture is clear, some is not."""
    clear = float((alpha < 0.5).mean())
    return ALPHA_SHARE < clear < 1.0 - 1e-4


def _check_figure(figure: np.ndarray, name: str) -> None:
    """Refuse what is no single figure (H, W) bool."""
    count = count_figures(figure)
    if count > 1:
        raise DataError(
            f"{name}: found {count} figures side by side, expected one: it looks like a sheet."
            f" {typed_or_clicked('Give it alone, as `charnerf reconstruct SHEET -o DIR`, or crop', 'Crop')} it to one figure. If"
            " it is one, its colours may be too near to the background's: save it with a transparent background."
        )
    share = float(figure.mean())
    if share < 0.002:
        raise DataError(
            f"{name}: found a figure of {100 * share:.2f} % of the picture, expected one that fills a good part of it. Its"
            " colours may be too near to the background's: save it with a transparent background."
        )


def _by_alpha(drawing: Drawing) -> Cutout:
    """The figure as the drawing's alpha says, without its shadow."""
    rgba, notes = drawing.rgba.copy(), ["cut out by its alpha"]
    shadow = shadow_by_alpha(rgba)
    if shadow.any():
        notes.append(SHADOW_NOTE)
        rgba[..., 3] *= ~shadow
    rgba[..., 3] *= _without_specks(rgba[..., 3] > 0.5, notes, margin=2)
    return Cutout(rgba, tuple(notes))


def _by_background(drawing: Drawing) -> Cutout:
    """The figure by the background that the drawing's border shows, and gaps in it."""
    notes: list[str] = []
    background = find_background(drawing)
    figure = ~background.mask
    window = frame_window(background.distance > FRAME_CONTRAST)
    if window is not None:
        drawing = cropped(drawing, window)
        background = find_background(drawing)
        figure = ~background.mask
        notes.append("a frame or an edge around the picture was left out")
    color = (255 * background.rgb).round().astype(int)
    kind = "a drawn checkerboard, taken for transparency" if background.is_checkered else "a background"
    notes.append(
        f"cut out from {kind} of about RGB {color[0]}, {color[1]}, {color[2]} (tolerance "
        f"{background.tolerance:.0f} in CIELAB)"
    )
    if float(figure.mean()) > FILLED_SHARE:
        raise DataError(
            f"{drawing.name}: found no background (the figure would fill {100 * float(figure.mean()):.0f} % "
            "of the picture), "
            "expected a figure on a plain background. Leave a margin, or save it with a transparent "
            "background."
        )
    shadow = shadow_on_paper(background.lab, background.paper, figure)
    if shadow.any():
        notes.append(SHADOW_NOTE)
        figure &= ~(shadow | _fenced_in(background, figure, shadow))
    figure = _without_specks(figure, notes, margin=0)
    drawn = on_white(drawing.rgba)
    return Cutout(_soft_outline(drawn, figure), tuple(notes), drawn, find_gaps(background, figure))


def _fenced_in(background: Background, figure: np.ndarray, shadow: np.ndarray) -> np.ndarray:
    """Paper (H, W) bool that a shadow alone cut off from the border's, as between legs."""
    paper = label((background.distance <= background.tolerance) & figure, connectivity=1)
    beside = np.unique(paper[ndimage.binary_dilation(shadow, iterations=3)])
    return np.isin(paper, beside[beside > 0])


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
