"""The picture of what was assumed: aligned figures with outline, height line, floor line and axis."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from charnerf.geometry.framing import HEIGHT

PANEL = 320  # pixels a side
CAPTION = 40
OUTLINE, LINE, AXIS = (220, 40, 40), (30, 90, 200), (150, 150, 150)


def draw_assumptions(
    canvases: list[np.ndarray], views: list[str], names: list[str], extent: float
) -> np.ndarray:
    """Draw the aligned figures side by side.

    Args:
        canvases: (S, S, 4) float each, straight alpha.
        views: What each is.
        names: Their files.
        extent: Half the canvas' side, m.

    Returns:
        RGB uint8, (PANEL + CAPTION, PANEL * number of figures, 3).
    """
    sheet = Image.new("RGB", (PANEL * len(canvases), PANEL + CAPTION), "white")
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=13)
    metre = PANEL / (2.0 * extent)
    floor, crown = 0.5 * PANEL + 0.5 * HEIGHT * metre, 0.5 * PANEL - 0.5 * HEIGHT * metre
    for column, (canvas, view, name) in enumerate(zip(canvases, views, names, strict=True)):
        left = column * PANEL
        sheet.paste(_panel(canvas), (left, 0))
        for y, text in ((floor, "floor, 0 m"), (crown, f"{HEIGHT:g} m")):
            draw.line((left, y, left + PANEL - 1, y), fill=LINE)
            draw.text((left + 4, y - 16 if y > 20 else y + 2), text, fill=LINE, font=font)
        middle = left + 0.5 * PANEL
        for y in range(0, PANEL, 8):
            draw.line((middle, y, middle, y + 3), fill=AXIS)
        draw.text((left + 4, PANEL + 3), view, fill="black", font=font)
        draw.text((left + 4, PANEL + 20), Path(name).name[-44:], fill=(90, 90, 90), font=font)
        draw.line((left, 0, left, PANEL + CAPTION), fill=(210, 210, 210))
    return np.asarray(sheet)


def _panel(canvas: np.ndarray) -> Image.Image:
    """A figure on white with its outline in red."""
    large = np.stack(
        [
            np.asarray(
                Image.fromarray(np.ascontiguousarray(canvas[..., c])).resize(
                    (PANEL, PANEL), Image.Resampling.BILINEAR
                )
            )
            for c in range(4)
        ],
        axis=-1,
    )
    alpha = large[..., 3:].clip(0.0, 1.0)
    on_white = np.round(255 * (large[..., :3].clip(0.0, 1.0) * alpha + 1.0 - alpha)).astype(np.uint8)
    mask = alpha[..., 0] > 0.5
    on_white[ndimage.binary_dilation(mask) & ~mask] = OUTLINE
    return Image.fromarray(on_white)
