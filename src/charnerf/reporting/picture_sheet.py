"""Sheets of pictures: labelled columns and rows, on white."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from torch import Tensor

from charnerf.pictures import bytes_on_white, cut_text, open_picture, save_png, to_bytes

CELL = 128  # pixels
_INK = (60, 60, 60)
_HEADER, _LINE, _LABEL = 18, 14, 150
_GAP = 6


def open_on_white(path: Path) -> Image.Image:
    """A picture file on white, RGB."""
    with open_picture(path) as picture:
        return Image.fromarray(bytes_on_white(np.asarray(picture.convert("RGBA"))))


def picture_on_white(rgba: Tensor | np.ndarray) -> Image.Image:
    """Straight-alpha pixels (H, W, 4) in [0, 1] on white, RGB."""
    return Image.fromarray(bytes_on_white(to_bytes(rgba)))


def save_sheet(
    path: Path, columns: Sequence[str], rows: Sequence[tuple[str, Sequence[Image.Image | None]]]
) -> Path:
    """Write a sheet: a picture or nothing in every cell; a label's lines stand before its row.

    Args:
        path: PNG file.
        columns: Titles; long ones take several lines.
        rows: Label (lines of text) and pictures.
    """
    font = ImageFont.load_default(11)
    titles = [_wrapped(title, font, CELL) for title in columns]
    header = _HEADER + _LINE * (max((len(lines) for lines in titles), default=1) - 1)
    size = (_LABEL + len(columns) * (CELL + _GAP), header + len(rows) * (CELL + _GAP))
    sheet = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(sheet)
    for column, lines in enumerate(titles):
        pen.multiline_text((_LABEL + column * (CELL + _GAP), 2), "\n".join(lines), _INK, font, spacing=2)
    for row, (label, pictures) in enumerate(rows):
        top = header + row * (CELL + _GAP)
        lines = [cut_text(line, font, _LABEL - 8) for line in label.splitlines()]
        pen.multiline_text((4, top + CELL // 2 - 7 * len(lines)), "\n".join(lines), _INK, font)
        for column, picture in enumerate(pictures):
            if picture is not None:
                small = picture.width < CELL and CELL % picture.width == 0
                how = Image.Resampling.NEAREST if small else Image.Resampling.LANCZOS
                sheet.paste(picture.resize((CELL, CELL), how), (_LABEL + column * (CELL + _GAP), top))
    save_png(path, sheet)
    return path


def _wrapped(text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> list[str]:
    """Lines of a text that fit into a width, broken at spaces; a longer word is cut."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and font.getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(cut_text(word, font, width))
    return lines or [""]
