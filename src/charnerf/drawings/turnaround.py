"""Drawings of one character to source views: what was assumed and mended is told in sentences and drawn in a picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
import torch

from charnerf.drawings.align import figure_box, half_extent, place
from charnerf.drawings.cutout import Cutout, cut_out, see_through
from charnerf.drawings.doubts import Doubt
from charnerf.drawings.drawn_figure import DrawnFigure
from charnerf.drawings.enclosed import shared
from charnerf.drawings.find_doubts import find_doubts
from charnerf.drawings.ink import INKED, find_outline_ink, painted_over
from charnerf.drawings.load import Drawing, drawing_from_array, load_drawing
from charnerf.drawings.missing_side import missing_side
from charnerf.drawings.options import ReadingOptions, Segment
from charnerf.drawings.picture import draw_assumptions
from charnerf.drawings.viewpoints import NEAR, Viewpoint, call_it, check_viewpoints, is_turned
from charnerf.errors import DataError
from charnerf.geometry.cameras import direction_from_angles
from charnerf.geometry.framing import framing_cameras
from charnerf.geometry.world import HEIGHT
from charnerf.reconciling import Reconciliation, reconcile
from charnerf.types import SourceViews
from charnerf.wording import typed_or_clicked

Picture = str | Path | np.ndarray
DETAIL = (256, 1024)  # pixels a side, least and most, of the detailed views


@dataclass(frozen=True)
class Turnaround:
    """Drawings made ready for the model.

    Attributes:
        views: B = 1, V in the order given: orthographic, S x S, reconciled. A guessed side stands for the three-quarter view
            that it was guessed from, or last.
        names: What each view is: "front", "left", "back", "45 degrees"; "left, guessed" where no side is drawn.
        detailed: The same views with as many pixels as the finest drawing has, within DETAIL; for textures.
        half_extent: Half the canvas' side, m.
        given_alphas: The views' masks before they were reconciled, (V, S, S).
        reconciliation: How the views agree, and what was moved.
        assumptions: What was done and assumed, plain sentences.
        doubts: What looks wrong.
        picture: RGB uint8 contact sheet: outlines, height line and floor line drawn into the aligned figures.
    """

    views: SourceViews
    detailed: SourceViews
    names: tuple[str, ...]
    half_extent: float
    given_alphas: np.ndarray
    reconciliation: Reconciliation
    assumptions: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    picture: np.ndarray

    @property
    def warnings(self) -> tuple[str, ...]:
        """What looks wrong, plain sentences."""
        return tuple(map(str, self.doubts))


def read_views(
    drawings: Mapping[Viewpoint, Picture], *, size: int, options: ReadingOptions | None = None
) -> Turnaround:
    """Read, cut out, align and reconcile drawings of one character.

    Args:
        drawings: Picture files or arrays (H, W, 3 or 4) by where they are seen from; where they disagree, the first rules.
        size: S, side of the model's source pictures, pixels.
        options: What is done to them; everything if None.

    Raises:
        DataError: If there are fewer than two, two show one view, or one can not be used; the message names its file.
    """
    if size < 16:
        raise DataError(f"size: found {size}, expected at least 16 pixels.")
    check_viewpoints(drawings)
    options = options or ReadingOptions()
    figures, inked = _figures(drawings, options)
    extent = half_extent([(figure.cutout.rgba[..., 3], figure.box) for figure in figures])
    given = _canvases(figures, extent, size)
    agreement = reconcile(
        given,
        [figure.viewpoint.azimuth_deg for figure in figures],
        [figure.viewpoint.elevation_deg for figure in figures],
    )
    finest = max(round(2.0 * extent * figure.box.height / HEIGHT) for figure in figures)
    detail = min(max(finest, DETAIL[0], size), max(DETAIL[1], size))
    canvases, detailed, widened = given, _canvases(figures, extent, detail), None
    if options.reconciled:
        canvases, detailed = agreement.apply(canvases), agreement.apply(detailed)
        widened = agreement.widened_alphas(canvases)
    names = tuple(figure.name for figure in figures)
    return Turnaround(
        views=_source_views(canvases, figures, extent, widened),
        detailed=_source_views(detailed, figures, extent),
        names=names,
        half_extent=extent,
        given_alphas=np.stack([canvas[..., 3] for canvas in given]),
        reconciliation=agreement,
        assumptions=(
            *_assumptions(figures, extent, size),
            *inked,
            *_mended(agreement, names, options.reconciled),
        ),
        doubts=find_doubts(figures, given, extent, agreement),
        picture=draw_assumptions(
            given, canvases, list(names), [figure.drawing.name for figure in figures], extent
        ),
    )


def _figures(
    drawings: Mapping[Viewpoint, Picture], options: ReadingOptions
) -> tuple[list[DrawnFigure], tuple[str, ...]]:
    """The figures cut out, without ink, with a side; and what is to be said of ink."""
    figures = _without_gaps([_prepare(view, source, options.segment) for view, source in drawings.items()])
    figures, inked = (figures, ()) if options.keep_ink else _without_ink(figures)
    return _with_side(figures) if options.reconciled else figures, inked


def _canvases(figures: Sequence[DrawnFigure], extent: float, size: int) -> list[np.ndarray]:
    """The figures on canvases (S, S, 4) of a size."""
    return [place(figure.cutout.rgba, figure.box, extent=extent, size=size) for figure in figures]


def _source_views(
    canvases: Sequence[np.ndarray],
    figures: Sequence[DrawnFigure],
    extent: float,
    widened: np.ndarray | None = None,
) -> SourceViews:
    """Canvases with their cameras, and what their hull is carved from, B = 1."""
    flags = torch.zeros(1, len(canvases), dtype=torch.bool)
    images = torch.from_numpy(np.stack(canvases)).permute(0, 3, 1, 2)[None].contiguous()
    angles = torch.tensor(
        [(one.viewpoint.azimuth_deg, one.viewpoint.elevation_deg) for one in figures], dtype=torch.float64
    )
    directions = direction_from_angles(angles[:, 0], angles[:, 1])
    cameras = framing_cameras(directions, radius=extent, size=images.shape[-1], orthographic=True)
    return SourceViews(
        images=images,
        cameras=cameras.to(torch.float32)[None],
        present=~flags,
        mirrored=flags.clone(),
        widened_alphas=None if widened is None else torch.from_numpy(widened)[None],
    )


def _prepare(viewpoint: Viewpoint, source: Picture, segment: Segment | None) -> DrawnFigure:
    """Read and cut out one drawing."""
    if isinstance(source, np.ndarray):
        drawing = drawing_from_array(source, f"the {viewpoint.name} drawing")
    else:
        drawing = load_drawing(source)
    cutout = cut_out(drawing, segment)
    return DrawnFigure(viewpoint, drawing, cutout, figure_box(cutout.rgba[..., 3], drawing.name))


def _without_gaps(figures: Sequence[DrawnFigure]) -> list[DrawnFigure]:
    """The figures seen through where they and the opposite view enclose paper at mirrored places."""
    opened = list(figures)
    for first, second in combinations(range(len(figures)), 2):
        if not _are_opposite(figures[first].viewpoint, figures[second].viewpoint):
            continue
        both = shared(figures[first].cutout.gaps, figures[second].cutout.gaps)
        for index, gaps in zip((first, second), both, strict=True):
            opened[index] = replace(opened[index], cutout=see_through(opened[index].cutout, gaps))
    return opened


def _are_opposite(one: Viewpoint, other: Viewpoint) -> bool:
    """Whether two level views mirror each other's outlines."""
    apart = (one.azimuth_deg - other.azimuth_deg) % 360.0
    return abs(apart - 180.0) < NEAR and one.elevation_deg == other.elevation_deg == 0.0


def _without_ink(figures: Sequence[DrawnFigure]) -> tuple[list[DrawnFigure], tuple[str, ...]]:
    """The figures without lines along their outlines, and a sentence; as they are where few outlines have any."""
    found = [find_outline_ink(figure.cutout.rgba) for figure in figures]
    share = sum(one.share for one in found) / len(found)
    if share < INKED:
        return list(figures), ()
    painted = [
        replace(figure, cutout=replace(figure.cutout, rgba=painted_over(figure.cutout.rgba, ink)))
        for figure, ink in zip(figures, found, strict=True)
    ]
    return painted, (
        f"{100 * share:.0f} % of the outlines are drawn as lines: these were taken for ink and painted over with the colours"
        f" beside them ({typed_or_clicked('--keep-ink leaves', '“Keep ink” leaves')} them).",
    )


def _with_side(figures: Sequence[DrawnFigure]) -> list[DrawnFigure]:
    """The figures with a side that is guessed where none is drawn: it stands for a three-quarter view, or last."""
    found = missing_side({figure.viewpoint: figure.cutout.rgba for figure in figures})
    if found is None:
        return list(figures)
    side, rgba = found
    name = f"the {side.name} side"
    drawing = Drawing(rgba, name, (rgba.shape[1], rgba.shape[0]), lossy=False)
    guess = DrawnFigure(side, drawing, Cutout(rgba, ()), figure_box(rgba[..., 3], name), is_guessed=True)
    with_it = [guess if is_turned(figure.viewpoint.azimuth_deg) else figure for figure in figures]
    return with_it if guess in with_it else [*with_it, guess]


def _assumptions(figures: Sequence[DrawnFigure], extent: float, size: int) -> list[str]:
    """What was done to single drawings."""
    lines = []
    figures = [figure for figure in figures if not figure.is_guessed]
    for figure in figures:
        width, height = figure.drawing.size
        lines.append(
            f"{figure.viewpoint.name} ({figure.drawing.name}, {width} x {height} pixels): "
            f"{'; '.join(figure.cutout.notes)}."
        )
    heights = ", ".join(
        f"{figure.viewpoint.name} {figure.box.height * _shrunk(figure.drawing):.0f}" for figure in figures
    )
    lines.append(f"The figures' heights ({heights} pixels) were taken as one and the same, {HEIGHT:g} m.")
    lines.append(
        "The lowest point of each figure was put on the floor line, the middle of its width on the axis."
    )
    lines.append(f"The pictures show {2 * extent:.2f} m a side without perspective, {size} x {size} pixels.")
    sides = [figure.viewpoint.name for figure in figures if figure.viewpoint.name in ("left", "right")]
    if len(sides) == 2:  # calling one of them the other would name a side twice
        lines.append(
            f"The {sides[0]} and {sides[1]} drawings look towards the picture's {sides[0]} and {sides[1]}. If they look the other"
            " way, swap the two."
        )
    elif sides:
        other = "right" if sides == ["left"] else "left"
        lines.append(
            f"The side drawing was taken as the character's {sides[0]} side: it looks towards the picture's {sides[0]}. If it looks"
            f" the other way, {call_it(other)}."
        )
    return lines


def _shrunk(drawing: Drawing) -> float:
    """Pixels of the file per pixel worked with."""
    return drawing.size[1] / drawing.rgba.shape[0]


def _mended(agreement: Reconciliation, names: Sequence[str], reconciled: bool) -> list[str]:
    """What was moved so that the views agree."""
    lines = []
    for name, view in zip(names, agreement.views, strict=True):
        if not view.is_mended or not reconciled:
            continue
        if view.partner is not None:
            lines.append(
                f"{name}: {100 * view.apart_before:.1f} % of its outline disagreed with the mirrored {names[view.partner]}'s (IoU"
                f" {view.iou_before:.2f}); it was moved there smoothly (IoU {view.iou_after:.2f}) and takes its outline."
            )
        else:
            lines.append(
                f"{name}: rows were moved by up to {100 * view.rows_moved:.1f} % of the picture's side to the heights of the"
                f" {names[0]}."
            )
    return lines
