"""One picture of several reconstructions: a row for each character, its drawings as given, then views from between them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

from charnerf.errors import DataError
from charnerf.files import write_aside
from charnerf.inference.hero import Hero
from charnerf.inference.model import Model
from charnerf.pictures import bytes_on_white, open_picture
from charnerf.reconstruction.turntable import ELEVATION_DEG

AZIMUTHS_DEG = (30, 60, 135, 225, 315)  # between and behind the drawings
DRAWN = ("front", "side", "back")
SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")
_CAPTION, _GAP = 20, 14
_INK, _RULE = (60, 60, 60), (215, 218, 222)


def write_gallery(model: Model, folders: Sequence[Path], output: Path, *, size: int) -> Path:
    """Reconstruct every folder's drawings and write the picture.

    Args:
        model: Loaded, on its device.
        folders: Each with pictures named front, side (or right, where it shows the character's right side) and back.
        output: PNG.
        size: Side of every panel, pixels.

    Returns:
        The picture's file.

    Raises:
        DataError: If a folder lacks a drawing, or one can not be used.
    """
    drawings = [find_drawings(folder) for folder in folders]  # all of them before any work
    sheet = Image.new("RGB", sheet_size(len(folders), size), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    titles = [*DRAWN, *(f"{azimuth}°" for azimuth in AZIMUTHS_DEG)]
    for column, title in enumerate(titles):
        pen.text((_left(column, size) + 4, 2), title, _INK, font)
    for row, (front, side, back) in enumerate(drawings):
        hero = model.encode(
            front=front, side=side, back=back, side_is="right" if side.stem.lower() == "right" else "left"
        )
        top = _CAPTION + row * size
        for column, panel in enumerate(
            [*(_fitted(file, size) for file in (front, side, back)), *_seen(hero, size)]
        ):
            sheet.paste(panel, (_left(column, size), top))
    x = _left(len(DRAWN), size) - _GAP // 2
    pen.line((x, 4, x, sheet.height - 4), fill=_RULE)
    with write_aside(output) as aside:
        sheet.save(aside, format="PNG", optimize=True)
    return output


def sheet_size(rows: int, size: int) -> tuple[int, int]:
    """Width and height of the picture, pixels."""
    return (len(DRAWN) + len(AZIMUTHS_DEG)) * size + _GAP, _CAPTION + rows * size


def find_drawings(folder: Path) -> tuple[Path, Path, Path]:
    """Front, side and back in a folder.

    Raises:
        DataError: If one is missing or there are two of it.
    """
    return _find(folder, "front"), _find(folder, "side", "right"), _find(folder, "back")


def _find(folder: Path, *stems: str) -> Path:
    matches = [
        path
        for path in (sorted(folder.iterdir()) if folder.is_dir() else [])
        if path.stem.lower() in stems and path.suffix.lower() in SUFFIXES
    ]
    if len(matches) != 1:
        found = f"found {', '.join(path.name for path in matches)}" if matches else "found no picture"
        raise DataError(
            f"{folder}: {found} of the {stems[0]} view, expected one named {' or '.join(stems)} ({', '.join(SUFFIXES)}); rename or"
            " add it."
        )
    return matches[0]


def _left(column: int, size: int) -> int:
    return column * size + (_GAP if column >= len(DRAWN) else 0)


def _fitted(file: Path, size: int) -> Image.Image:
    """A drawing as it was given, on white, in a square panel."""
    with open_picture(file) as opened:
        pixels = bytes_on_white(np.asarray(ImageOps.exif_transpose(opened).convert("RGBA")))
    return ImageOps.pad(Image.fromarray(pixels), (size, size), Image.Resampling.LANCZOS, color="white")


def _seen(hero: Hero, size: int) -> list[Image.Image]:
    """Novel views on white."""
    pictures = [hero.render(azimuth_deg=a, elevation_deg=ELEVATION_DEG, size=size) for a in AZIMUTHS_DEG]
    return [
        Image.fromarray(bytes_on_white(np.rint(255.0 * picture).astype(np.uint8))) for picture in pictures
    ]
