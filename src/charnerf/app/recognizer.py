"""What the page's pictures show: figures found, named, cut out and reconciled. Runs in a process of its own."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import final

import numpy as np
from PIL import Image

from charnerf.app.answers import Found, Recognized, RecognizedView
from charnerf.app.figures import Figure, in_order, view_by_name, view_text
from charnerf.app.settings import Reading
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.find_doubts import LEAST_AGREEMENT
from charnerf.drawings.load import Drawing, load_drawing
from charnerf.drawings.naming import MOST_NAMED, name_views
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.picture import CAPTION, PANEL
from charnerf.drawings.read_sheet import canvases_to_name, named_view, square_views
from charnerf.drawings.segmenters import segmenter_by_name
from charnerf.drawings.sheet import Sheet, find_figures
from charnerf.drawings.turnaround import Picture, Turnaround, read_views
from charnerf.drawings.viewpoints import Viewpoint, viewpoint
from charnerf.errors import DataError
from charnerf.inference.model import Model
from charnerf.pictures import open_picture, to_bytes
from charnerf.reconciling import ViewAgreement

THUMBNAIL = 480  # pixels, at most


@final
class Recognizer:
    """Answers what pictures show.

    Args:
        load: Gives the model.
    """

    def __init__(self, load: Callable[[], Model]) -> None:
        self.size = load().image_size

    def ready(self) -> int:
        """Side of the model's pictures, pixels: the model can be loaded."""
        return self.size

    def examine(self, file: Path, title: str, thumbnail: Path, most_pixels: int, reading: Reading) -> Found:
        """Find the figures of a picture, and write a small one of it and of each figure: N.png, N-0.png, N-1.png and so on.

        Raises:
            DataError: If it can not be used.
        """
        _check_pixels(file, title, most_pixels)
        drawing = load_drawing(file)
        _save_small(drawing, thumbnail)
        sheet = _sheet(file)
        if sheet is None:
            cut_out(drawing, reading_options(reading).segment)  # says what is wrong with it now, not later
            return Found(((0.0, 0.0, 1.0, 1.0),), False)
        for index, figure in enumerate(sheet.figures):
            _save_small(figure.drawing, thumbnail.with_stem(f"{thumbnail.stem}-{index}"))
        height, width = drawing.rgba.shape[:2]
        boxes = [one.box for one in sheet.figures]
        return Found(tuple((a / width, b / height, c / width, d / height) for a, b, c, d in boxes), True)

    def name(self, figures: Sequence[Figure], reading: Reading) -> list[Figure]:
        """Say from where each figure is seen: by its file's name, else by how it looks beside the others.

        Raises:
            DataError: If one can not be cut out.
        """
        canvases = canvases_to_name([_drawing(one) for one in figures], reading_options(reading).segment)
        told = [view_by_name(one.title) if one.part is None else None for one in figures]
        shown = {name: canvas for name, canvas in zip(told, canvases, strict=True) if name is not None}
        named = [
            None if name is None else view_text(named_view(name, canvas, shown))
            for name, canvas in zip(told, canvases, strict=True)
        ]
        if None in named and 2 <= len(figures) <= MOST_NAMED:
            seen = [view_text(view) for view in square_views(name_views(canvases).viewpoints)]
            fits = all(name in (None, view) for name, view in zip(named, seen, strict=True))
            named = list(seen) if fits else named
        rest = [view for view in ("front", "left", "back", "right") if view not in named]
        taken: set[str] = set()
        views = []
        for name in named:
            view = name if name is not None else rest.pop(0) if rest else ""
            views.append("" if view in taken else view)
            taken.add(view)
        return [replace(one, view=view) for one, view in zip(figures, views, strict=True)]

    def recognize(self, figures: Sequence[Figure], reading: Reading, folder: Path) -> Recognized:
        """Read the views as the model will, and write pictures of how they were cut out and reconciled.

        Raises:
            DataError: If they can not be used.
        """
        used = in_order(figures)
        read = read_views(given_drawings(used), size=self.size, options=reading_options(reading))
        folder.mkdir(parents=True)
        shown = zip(  # a side that was guessed beside them comes last
            used, read.names, read.reconciliation.views, _panels(read, len(used), folder), strict=False
        )
        views = tuple(
            RecognizedView(figure.number, name, given, mended, *agreement_words(agreement, read.names))
            for figure, name, agreement, (given, mended) in shown
        )
        return Recognized(views, read.assumptions, read.warnings)


@lru_cache(maxsize=2)
def reading_options(reading: Reading) -> ReadingOptions:
    """How drawings are read, with what that needs: a network is loaded once.

    Raises:
        ConfigError: If the network is not on this machine.
        DependencyError: If what runs it is missing.
    """
    segment = segmenter_by_name(reading.segmenter)
    return ReadingOptions(reading.reconciled, reading.keep_ink, segment)


def given_drawings(used: Sequence[Figure]) -> dict[Viewpoint, Picture]:
    """The drawings of figures by where they are seen from: files where nothing is to be done to them before."""
    return {
        viewpoint(one.view): one.file if one.part is None and not one.is_mirrored else _drawing(one).rgba
        for one in used
    }


def agreement_words(view: ViewAgreement, names: Sequence[str]) -> tuple[str, str]:
    """Tone and sentence of how a view agrees with those before it."""
    if view.copies is not None:
        return "doubtful", f"Shows the same as the {names[view.copies]}: was one picture used twice?"
    if np.isinf(view.tolerance).all():
        return "doubtful", "Fits none of the views before it: it colours the figure, but does not shape it."
    if view.partner is not None:
        return _outline_words(view, names[view.partner])
    if view.is_mended:
        moved = f"{100 * view.rows_moved:.1f} %"
        return "moved", f"Rows were moved by up to {moved} to the heights of the {names[0]}."
    return "good", "Stands as drawn."


def _outline_words(view: ViewAgreement, partner: str) -> tuple[str, str]:
    """The same of a view whose outline ought to be another one's, mirrored."""
    shares = f"Its outline shares {100 * view.iou_before:.0f} % with the mirrored {partner}'s"
    if view.iou_before < LEAST_AGREEMENT:
        return "doubtful", f"{shares}: is it of another pose, or another view?"
    if not view.is_mended:
        return "good", f"{shares}."
    apart, after = f"{100 * view.apart_before:.1f} %", f"{100 * view.iou_after:.0f} %"
    return "moved", f"{shares}; {apart} lay apart and was moved there ({after} now)."


def _check_pixels(file: Path, title: str, most: int) -> None:
    """Refuse what would fill the memory before it is decoded."""
    try:
        with open_picture(file, title) as picture:
            width, height = picture.size
    except DataError:
        raise
    except (OSError, SyntaxError, ValueError) as error:
        raise DataError(
            f"{title}: found a file that is no picture, expected PNG, JPEG or WebP. Export it again."
        ) from error
    if width * height > most:
        raise DataError(
            f"{title}: found {width} x {height} pixels, expected at most {most / 1e6:.0f} million; a side of 1000 to 2000 is"
            " plenty. Reduce the picture."
        )


def _save_small(drawing: Drawing, file: Path) -> None:
    """Write a small picture of a drawing."""
    small = Image.fromarray(to_bytes(drawing.rgba))
    small.thumbnail((THUMBNAIL, THUMBNAIL))
    small.save(file)


@lru_cache(maxsize=8)
def _sheet(file: Path) -> Sheet | None:
    """The figures of a picture that shows several."""
    drawing = load_drawing(file)
    try:
        sheet = find_figures(drawing)
    except DataError:
        return None  # one drawing, then: its own reading says what is wrong with it
    return sheet if len(sheet.figures) > 1 else None


def _drawing(figure: Figure) -> Drawing:
    """A figure as it is read."""
    if figure.part is None:
        drawing = load_drawing(figure.file)
    else:
        sheet = _sheet(figure.file)
        assert sheet is not None  # its parts were found there
        drawing = sheet.figures[figure.part].drawing
    return replace(drawing, rgba=drawing.rgba[:, ::-1].copy()) if figure.is_mirrored else drawing


def _panels(read: Turnaround, count: int, folder: Path) -> list[tuple[str, str | None]]:
    """Cut the picture of what was assumed into files, one a view as drawn and one as reconciled where it was moved."""
    rows = [read.picture[top : top + PANEL] for top in range(0, len(read.picture), PANEL + CAPTION)]
    names = []
    for index in range(count):
        files: list[str | None] = []
        for kind, row in zip(("given", "mended"), rows, strict=False):
            file = folder / f"{index}_{kind}.png"
            Image.fromarray(row[:, index * PANEL : (index + 1) * PANEL]).save(file)
            files.append(file.name)
        is_mended = len(files) == 2 and read.reconciliation.views[index].is_mended
        names.append((str(files[0]), files[1] if is_mended else None))
    return names
