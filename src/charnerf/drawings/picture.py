"""The picture of what was assumed and mended: aligned figures with outline, height line, floor line and axis."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from charnerf.geometry.world import HEIGHT
from charnerf.pictures import cut_text

PANEL = 320  # pixels a side
CAPTION = 40
OUTLINE, LINE, AXIS = (220, 40, 40), (30, 90, 200), (150, 150, 150)
APART = (255, 170, 0)  # what one drawing shows and its mended view does not, or the other way round


def draw_assumptions(
    given: Sequence[np.ndarray],
    mended: Sequence[np.ndarray],
    views: Sequence[str],
    names: Sequence[str],
    extent: float,
) -> np.ndarray:
    """Draw the aligned figures side by side; where any was moved, a second row shows them reconciled.

    Args:
        given: As drawn, (S, S, 4) float each, straight alpha.
        mended: Reconciled; the same array where a view was left as it was.
        views: What each is.
        names: Their files.
        extent: Half the canvas' side, m.

    Returns:
        RGB uint8, (PANEL + CAPTION, PANEL * number of figures, 3), or twice as tall.
    """
    rows = [_row(given, views, [Path(name).name for name in names], extent)]
    if any(one is not other for one, other in zip(given, mended, strict=True)):
        captions = [
            "as drawn" if one is other else "reconciled; what moved is orange"
            for one, other in zip(given, mended, strict=True)
        ]
        rows.append(_row(mended, views, captions, extent, before=given))
    return np.concatenate(rows)


def _row(
    canvases: Sequence[np.ndarray],
    views: Sequence[str],
    captions: Sequence[str],
    extent: float,
    *,
    before: Sequence[np.ndarray] | None = None,
) -> np.ndarray:
    sheet = Image.new("RGB", (PANEL * len(canvases), PANEL + CAPTION), "white")
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=13)
    metre = PANEL / (2.0 * extent)
    floor, crown = 0.5 * PANEL + 0.5 * HEIGHT * metre, 0.5 * PANEL - 0.5 * HEIGHT * metre
    for column, (canvas, view, caption) in enumerate(zip(canvases, views, captions, strict=True)):
        left = column * PANEL
        sheet.paste(_panel(canvas, canvas if before is None else before[column]), (left, 0))
        for y, text in ((floor, "floor, 0 m"), (crown, f"{HEIGHT:g} m")):
            draw.line((left, y, left + PANEL - 1, y), fill=LINE)
            draw.text((left + 4, y - 16 if y > 20 else y + 2), text, fill=LINE, font=font)
        middle = left + 0.5 * PANEL
        for y in range(0, PANEL, 8):
            draw.line((middle, y, middle, y + 3), fill=AXIS)
        draw.text((left + 4, PANEL + 3), view, fill="black", font=font)
        draw.text((left + 4, PANEL + 20), cut_text(caption, font, PANEL - 8), fill=(90, 90, 90), font=font)
        draw.line((left, 0, left, PANEL + CAPTION), fill=(210, 210, 210))
    return np.asarray(sheet)


def _panel(canvas: np.ndarray, before: np.ndarray) -> Image.Image:
    """A figure on white with its outline in red; where the outline before it was another, that in orange."""
    large = _enlarged(canvas)
    alpha = large[..., 3:]
    pixels = np.round(255 * (large[..., :3] * alpha + 1.0 - alpha)).astype(np.uint8)
    mask = alpha[..., 0] > 0.5
    if before is not canvas:
        apart = ndimage.binary_opening((_enlarged(before)[..., 3] > 0.5) ^ mask, iterations=2)
        pixels[apart] = (0.5 * pixels[apart] + 0.5 * np.array(APART)).astype(np.uint8)
    pixels[ndimage.binary_dilation(mask) & ~mask] = OUTLINE
    return Image.fromarray(pixels)


def _enlarged(canvas: np.ndarray) -> np.ndarray:
    """A canvas (S, S, 4) at PANEL pixels a side."""
    channels = [
        np.asarray(
            Image.fromarray(np.ascontiguousarray(canvas[..., c])).resize(
                (PANEL, PANEL), Image.Resampling.BILINEAR
            )
        )
        for c in range(4)
    ]
    return np.stack(channels, axis=-1).clip(0.0, 1.0)
