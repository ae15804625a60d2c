"""A painted figure with known outlines, seen from front, side and back, in any crop, size and background."""

import numpy as np
from PIL import Image, ImageDraw

SCALE = 200  # pixels a metre
SIDE = 2.6  # metres of the canvas
MIDDLE = SIDE / 2


def _at(x: float, z: float) -> tuple[float, float]:
    return (x + MIDDLE) * SCALE, (MIDDLE + 1.0 - z) * SCALE


def _box(draw, x0, z0, x1, z1, color):
    (left, bottom), (right, top) = _at(x0, z0), _at(x1, z1)
    draw.rectangle((left, top, right, bottom), fill=color)


def _disc(draw, x, z, radius, color):
    (left, bottom), (right, top) = _at(x - radius, z - radius), _at(x + radius, z + radius)
    draw.ellipse((left, top, right, bottom), fill=color)


def paint(view: str) -> Image.Image:
    """RGBA, 2 m figure: asymmetric (a shield at its left), white shirt enclosed by blue, nose in profile."""
    picture = Image.new("RGBA", (round(SIDE * SCALE),) * 2, (0, 0, 0, 0))
    draw = ImageDraw.Draw(picture)
    flip = -1.0 if view == "back" else 1.0
    if view == "side":
        _box(draw, -0.12, 0.0, 0.12, 0.9, (70, 40, 30, 255))
        _box(draw, -0.18, 0.8, 0.18, 1.5, (30, 60, 200, 255))
        _disc(draw, 0.0, 1.75, 0.25, (230, 180, 150, 255))
        _box(draw, -0.34, 1.7, -0.2, 1.76, (200, 120, 100, 255))  # nose
    else:
        _box(draw, -0.25, 0.0, -0.05, 0.9, (70, 40, 30, 255))
        _box(draw, 0.05, 0.0, 0.25, 0.9, (70, 40, 30, 255))
        _box(draw, -0.3, 0.8, 0.3, 1.5, (30, 60, 200, 255))
        if view == "front":
            _box(draw, -0.15, 0.95, 0.15, 1.35, (255, 255, 255, 255))
        _disc(draw, 0.0, 1.75, 0.25, (230, 180, 150, 255))
        _box(draw, -0.75, 1.3, 0.75, 1.42, (30, 60, 200, 255))
        # the shield hangs at the character's left, the picture's right from the front
        _disc(draw, 0.65 * flip, 1.2, 0.2, (180, 160, 40, 255))
    return picture


def on_background(picture: Image.Image, color=(255, 255, 255)) -> Image.Image:
    """Without alpha, on a plain colour."""
    plain = Image.new("RGBA", picture.size, (*color, 255))
    plain.alpha_composite(picture)
    return plain.convert("RGB")


def cropped(picture: Image.Image, share: float, margins: tuple[int, int, int, int]) -> Image.Image:
    """Resized by a share and cropped to the figure with margins (left, top, right, bottom), pixels."""
    small = picture.resize((round(picture.width * share),) * 2, Image.Resampling.BOX)
    left, top, right, bottom = small.getbbox()
    return small.crop((left - margins[0], top - margins[1], right + margins[2], bottom + margins[3]))


def noisy_paper(picture: Image.Image, seed: int) -> Image.Image:
    """On yellowish paper that darkens to one corner, with grain."""
    width, height = picture.size
    y, x = np.mgrid[0:height, 0:width]
    shade = 12.0 * (x / width + y / height)
    paper = np.stack([np.full((height, width), c, float) for c in (244, 238, 222)], -1) - shade[..., None]
    paper += np.random.default_rng(seed).normal(0.0, 1.5, paper.shape)
    rgba = np.asarray(picture, float)
    alpha = rgba[..., 3:] / 255.0
    return Image.fromarray(
        (rgba[..., :3] * alpha + paper * (1.0 - alpha)).clip(0, 255).round().astype(np.uint8)
    )
