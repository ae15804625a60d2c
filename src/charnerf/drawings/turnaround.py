"""Three drawings to source views: what was assumed is said in sentences and drawn in a picture."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from charnerf.drawings.align import FigureBox, figure_box, half_extent, place
from charnerf.drawings.cutout import Cutout, cut_out
from charnerf.drawings.load import Drawing, drawing_from_array, load_drawing
from charnerf.drawings.picture import draw_assumptions
from charnerf.errors import DataError
from charnerf.geometry.framing import HEIGHT, SOURCE_AZIMUTHS, source_cameras
from charnerf.types import SourceViews

SIDES = {"left": 90.0, "right": 270.0}  # azimuth of the camera that a side drawing stands for
LEAST_AGREEMENT = 0.85  # IoU of the back's silhouette with the mirrored front's
DETAIL = (256, 1024)  # pixels a side, least and most, of the detailed views


@dataclass(frozen=True)
class Turnaround:
    """Drawings made ready for the model.

    Attributes:
        views: B = 1, V in the order front, side, back: orthographic, S x S.
        names: What each view is: "front", "side", "back".
        detailed: The same views with as many pixels as the finest drawing has, within DETAIL; for textures.
        half_extent: Half the canvas' side, m.
        assumptions: What was done and assumed, plain sentences.
        warnings: What looks wrong, plain sentences.
        picture: RGB uint8 contact sheet: outlines, height line and floor line drawn into the aligned figures.
    """

    views: SourceViews
    detailed: SourceViews
    names: tuple[str, ...]
    half_extent: float
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]
    picture: np.ndarray


@dataclass(frozen=True)
class _Figure:
    """One figure on its way."""

    view: str
    drawing: Drawing
    cutout: Cutout
    box: FigureBox


def read_turnaround(
    front: str | Path | np.ndarray,
    side: str | Path | np.ndarray,
    back: str | Path | np.ndarray,
    *,
    size: int,
    side_is: str = "left",
) -> Turnaround:
    """Read, cut out and align three drawings of one character.

    Args:
        front: Picture file or array (H, W, 3 or 4): the character faces the viewer.
        side: The character in profile.
        back: Seen from behind.
        size: S, side of the model's source pictures, pixels.
        side_is: "left": the character's left side is seen, it looks towards the picture's left (azimuth 90).
            "right": its right side, it looks towards the picture's right (azimuth 270); the drawing is kept
            as it is and its camera moved.

    Raises:
        DataError: If a drawing can not be used; the message names its file.
    """
    if side_is not in SIDES:
        raise DataError(
            f"side: found '{side_is}', expected 'left' or 'right': which side of the character is drawn."
        )
    if size < 16:
        raise DataError(f"size: found {size}, expected at least 16 pixels.")
    given = {"front": front, "side": side, "back": back}
    figures = [_prepare(view, source) for view, source in given.items()]
    extent = half_extent([(figure.cutout.rgba[..., 3], figure.box) for figure in figures])
    canvases = _canvases(figures, extent, size)
    azimuths = [*{**SOURCE_AZIMUTHS, "side": SIDES[side_is]}.values()]
    assumptions, warnings = _told(figures, extent, size, side_is)
    warnings += _check_back(canvases[0][..., 3], canvases[2][..., 3], figures[2].drawing.name)
    finest = max(round(2.0 * extent * figure.box.height / HEIGHT) for figure in figures)
    detail = min(max(finest, DETAIL[0], size), max(DETAIL[1], size))
    return Turnaround(
        views=_source_views(canvases, azimuths, extent),
        detailed=_source_views(_canvases(figures, extent, detail), azimuths, extent),
        names=tuple(given),
        half_extent=extent,
        assumptions=tuple(assumptions),
        warnings=tuple(warnings),
        picture=draw_assumptions(
            canvases, [f.view for f in figures], [f.drawing.name for f in figures], extent
        ),
    )


def _canvases(figures: list[_Figure], extent: float, size: int) -> list[np.ndarray]:
    """The figures on canvases (S, S, 4) of a size."""
    return [place(figure.cutout.rgba, figure.box, extent=extent, size=size) for figure in figures]


def _source_views(canvases: list[np.ndarray], azimuths_deg: list[float], extent: float) -> SourceViews:
    """Canvases with their cameras, B = 1."""
    flags = torch.zeros(1, len(canvases), dtype=torch.bool)
    images = torch.from_numpy(np.stack(canvases)).permute(0, 3, 1, 2)[None].contiguous()
    cameras = source_cameras(azimuths_deg, radius=extent, size=images.shape[-1]).to(torch.float32)
    return SourceViews(images=images, cameras=cameras[None], present=~flags, mirrored=flags.clone())


def _prepare(view: str, source: str | Path | np.ndarray) -> _Figure:
    """Read and cut out one drawing."""
    if isinstance(source, np.ndarray):
        drawing = drawing_from_array(source, f"the {view} drawing")
    else:
        drawing = load_drawing(source)
    cutout = cut_out(drawing)
    return _Figure(view, drawing, cutout, figure_box(cutout.rgba[..., 3], drawing.name))


def _told(figures: list[_Figure], extent: float, size: int, side_is: str) -> tuple[list[str], list[str]]:
    """What was done, and what looks wrong in single drawings."""
    told, warnings = [], []
    for figure in figures:
        width, height = figure.drawing.size
        told.append(
            f"{figure.view} ({figure.drawing.name}, {width} x {height} pixels): "
            f"{'; '.join(figure.cutout.notes)}."
        )
        pixels = figure.box.height * 2.0 * extent / HEIGHT
        if pixels < 0.5 * size:
            warnings.append(
                f"{figure.drawing.name}: the figure is {figure.box.height:.0f} pixels tall, fewer than the "
                "model reads: use a larger picture."
            )
    heights = ", ".join(
        f"{figure.view} {figure.box.height * _shrunk(figure.drawing):.0f}" for figure in figures
    )
    told.append(f"The figures' heights ({heights} pixels) were taken as one and the same, {HEIGHT:g} m.")
    told.append(
        "The lowest point of each figure was put on the floor line, the middle of its width on the axis."
    )
    told.append(f"The pictures show {2 * extent:.2f} m a side without perspective, {size} x {size} pixels.")
    looks = "left" if side_is == "left" else "right"
    told.append(
        f"The side drawing was taken as the character's {side_is} side: it looks towards the picture's "
        f"{looks}. "
        f"If it looks the other way, say --side {'right' if side_is == 'left' else 'left'}."
    )
    return told, warnings


def _shrunk(drawing: Drawing) -> float:
    """Pixels of the file per pixel worked with."""
    return drawing.size[1] / drawing.rgba.shape[0]


def _check_back(front: np.ndarray, back: np.ndarray, name: str) -> list[str]:
    """Compare the back's silhouette with the front's, mirrored as it should be and not."""
    mirrored, plain = silhouette_iou(front[:, ::-1], back), silhouette_iou(front, back)
    warnings = []
    if mirrored < LEAST_AGREEMENT:
        warnings.append(
            f"{name}: the back's silhouette covers only {100 * mirrored:.0f} % of what it shares with the "
            "mirrored front's "
            f"(IoU, expected {100 * LEAST_AGREEMENT:.0f} % or more): the drawings differ in pose or are not "
            "of one character."
        )
    if plain > mirrored + 0.02:
        warnings.append(
            f"{name}: the back fits the front better unmirrored (IoU {plain:.2f} against {mirrored:.2f}): a "
            "view from behind "
            "shows left and right swapped. Was the front traced? Mirror the back drawing if so."
        )
    return warnings


def silhouette_iou(first: np.ndarray, second: np.ndarray) -> float:
    """Intersection over union of two alphas (H, W) at one half; 0 where both are empty."""
    union = int(((first > 0.5) | (second > 0.5)).sum())
    return int(((first > 0.5) & (second > 0.5)).sum()) / union if union else 0.0
