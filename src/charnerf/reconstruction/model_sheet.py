"""A result as artists are used to see a character: the drawings, then a turnaround of eight views in one row."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from charnerf.drawings.turnaround import Turnaround
from charnerf.pictures import bytes_on_white, cut_text, to_bytes

VIEWS = 8
_CAPTION, _GAP = 20, 12
_INK, _RULE = (60, 60, 60), (215, 218, 222)


def model_sheet(drawings: Turnaround, frames: Sequence[np.ndarray]) -> Image.Image:
    """Draw the sheet.

    Args:
        drawings: As they were read.
        frames: Pictures evenly around the character from its front on, RGBA uint8 (S, S, 4); at least one.

    Returns:
        RGB: the drawings above, as given to the model, views every 45 degrees below (the nearest frames).
    """
    size = frames[0].shape[0]
    given = drawings.detailed.images[0].permute(0, 2, 3, 1).numpy()
    upper = [
        Image.fromarray(bytes_on_white(to_bytes(one))).resize((size, size), Image.Resampling.LANCZOS)
        for one in given
    ]
    turns = [round(index * len(frames) / VIEWS) % len(frames) for index in range(VIEWS)]
    lower = [Image.fromarray(bytes_on_white(frames[turn])) for turn in turns]
    titles = [f"{360.0 * turn / len(frames):.0f}°" for turn in turns]
    columns = max(len(upper), len(lower))
    sheet = Image.new("RGB", (columns * size, 2 * (size + _CAPTION) + _GAP), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    for row, (pictures, names) in enumerate(((upper, drawings.names), (lower, titles))):
        top = row * (size + _CAPTION + _GAP)
        for column, (picture, name) in enumerate(zip(pictures, names, strict=True)):
            pen.text((column * size + 4, top + 2), cut_text(name, font, size - 6), _INK, font)
            sheet.paste(picture, (column * size, top + _CAPTION))
    middle = size + _CAPTION + _GAP // 2
    pen.line((0, middle, sheet.width, middle), fill=_RULE)
    return sheet
