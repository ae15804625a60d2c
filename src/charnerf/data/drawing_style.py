"""Captured pictures as somebody would draw them: flat tones, ink along contours and edges, a hand that is not exact.

One style is drawn at random for all views of a character; each view then has its own small mistakes of place, size and line.
Torch on whole batches, so that training can afford it. Letters: V views, H rows, W columns.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

REFERENCE_SIDE = 128  # pixels: widths are given for pictures of this side and grow with them
_WOBBLE_KNOTS = 7  # a side: a wave of the hand is about a sixth of the picture
_EDGE_CONTRAST = 0.1  # of brightness within half a line's width that gets half the ink
_INK_COLORS = ((0.05, 0.05, 0.07), (0.16, 0.10, 0.08), (0.10, 0.12, 0.22))  # black, sepia, blue-black


@dataclass(frozen=True)
class DrawingStyle:
    """How one artist draws a character.

    Attributes:
        ink: Opacity of contours, in [0, 1].
        inner_ink: Opacity of lines along edges of colour inside the figure, in [0, 1].
        ink_rgb: Their colour.
        line_pixels: Their width in a picture of 128 pixels.
        tones: Number of flat tones that brightness is painted in; 0 keeps it as it is.
        saturation: Factor on the difference from grey.
        wobble: Largest displacement by the unsteady hand, as a share of the picture's side.
        shift: Largest offset of a view against the others, as a share of the picture's side.
        scale: Largest relative difference in size of a view.
    """

    ink: float
    inner_ink: float
    ink_rgb: tuple[float, float, float]
    line_pixels: float
    tones: int
    saturation: float
    wobble: float
    shift: float
    scale: float


EXACT = DrawingStyle(
    ink=0.0,
    inner_ink=0.0,
    ink_rgb=(0.0, 0.0, 0.0),
    line_pixels=1.0,
    tones=0,
    saturation=1.0,
    wobble=0.0,
    shift=0.0,
    scale=0.0,
)
"""Gives pictures back as they are."""


def random_style(generator: torch.Generator, *, wobble: float, shift: float, scale: float) -> DrawingStyle:
    """Draw a style; the bounds of a view's mistakes are given, as shares of the side."""
    draws = torch.rand(6, generator=generator).tolist()
    return DrawingStyle(
        ink=0.45 + 0.55 * draws[0],
        inner_ink=0.9 * draws[1],
        ink_rgb=_INK_COLORS[int(draws[2] * len(_INK_COLORS))],
        line_pixels=0.8 + 0.8 * draws[3],
        tones=0 if draws[4] < 0.25 else 3 + int(8 * (draws[4] - 0.25)),
        saturation=0.85 + 0.3 * draws[5],
        wobble=wobble,
        shift=shift,
        scale=scale,
    )


def draw_pictures(images: Tensor, style: DrawingStyle, generator: torch.Generator) -> Tensor:
    """Draw pictures in a style.

    Args:
        images: RGBA in [0, 1], straight alpha, (V, 4, H, W).
        style: The same for all.
        generator: Of each view's mistakes.

    Returns:
        RGBA in [0, 1], straight alpha, (V, 4, H, W).
    """
    rgb = _toned(images[:, :3], style)
    alpha = images[:, 3:]
    width = style.line_pixels * min(images.shape[-2:]) / REFERENCE_SIDE
    ink = torch.maximum(
        style.ink * contour_ink(alpha, width), style.inner_ink * edge_ink(images[:, :3], alpha, width)
    )
    color = images.new_tensor(style.ink_rgb)[:, None, None]
    premultiplied = torch.cat(((rgb + ink * (color - rgb)) * alpha, alpha), dim=1)
    moved = F.grid_sample(
        premultiplied, _hand(images, style, generator), padding_mode="zeros", align_corners=False
    )
    alpha = moved[:, 3:]
    return torch.cat((moved[:, :3] / alpha.clamp_min(1e-4), alpha), dim=1).clamp(0.0, 1.0)


def contour_ink(alpha: Tensor, width: float) -> Tensor:
    """Share of ink (V, 1, H, W) in [0, 1] of a line of some pixels along the inside of silhouettes (V, 1, H, W)."""
    return alpha - _blend_of_windows(alpha, width, _smallest)


def edge_ink(rgb: Tensor, alpha: Tensor, width: float) -> Tensor:
    """Share of ink (V, 1, H, W) in [0, 1] on the darker side of edges between colours (V, 3, H, W) inside the figure."""
    inside = (alpha > 0.5).to(rgb.dtype)
    grey = rgb.mean(dim=1, keepdim=True) * inside  # what is beside the figure is no lighter neighbour
    contrast = _blend_of_windows(grey, 0.5 * width, _largest) - grey
    return inside * torch.sigmoid((contrast - _EDGE_CONTRAST) * (6.0 / _EDGE_CONTRAST))


def _toned(rgb: Tensor, style: DrawingStyle) -> Tensor:
    """Colours with another saturation, their brightness in flat tones."""
    grey = rgb.mean(dim=1, keepdim=True)
    rgb = (grey + style.saturation * (rgb - grey)).clamp(0.0, 1.0)
    if style.tones == 0:
        return rgb
    brightness = rgb.amax(dim=1, keepdim=True)
    step = (brightness * style.tones).floor().clamp_max(style.tones - 1)
    flat = (step + 0.5) / (style.tones - 0.5)  # white stays white, the darkest is not black
    return (rgb * (flat / brightness.clamp_min(1e-3))).clamp(0.0, 1.0)


def _hand(images: Tensor, style: DrawingStyle, generator: torch.Generator) -> Tensor:
    """Where each pixel of the drawings comes from, (V, H, W, 2) in [-1, 1]: an offset, a size and a wobble a view."""
    views, _, height, width = images.shape
    draws = 2.0 * torch.rand(views, 3, generator=generator) - 1.0
    offsets = 2.0 * style.shift * draws[:, :2]
    factors = 1.0 + style.scale * draws[:, 2]
    knots = 2.0 * torch.rand(views, 2, _WOBBLE_KNOTS, _WOBBLE_KNOTS, generator=generator) - 1.0
    waves = F.interpolate(knots, size=(height, width), mode="bicubic", align_corners=True)
    rows, columns = ((2.0 * torch.arange(n) + 1.0) / n - 1.0 for n in (height, width))
    y, x = torch.meshgrid(rows, columns, indexing="ij")
    still = torch.stack((x, y), dim=-1) * factors[:, None, None, None] + offsets[:, None, None]
    return (still + 2.0 * style.wobble * waves.permute(0, 2, 3, 1)).to(images)


def _largest(maps: Tensor, radius: int) -> Tensor:
    if radius == 0:
        return maps
    columns = F.max_pool2d(maps, (2 * radius + 1, 1), stride=1, padding=(radius, 0))
    return F.max_pool2d(columns, (1, 2 * radius + 1), stride=1, padding=(0, radius))


def _smallest(maps: Tensor, radius: int) -> Tensor:
    return -_largest(-maps, radius)


def _blend_of_windows(maps: Tensor, width: float, pick: Callable[[Tensor, int], Tensor]) -> Tensor:
    """Extreme values within a radius that need not be a whole number of pixels."""
    radius = int(width)
    share = width - radius
    small = pick(maps, radius)
    return small if share == 0.0 else (1.0 - share) * small + share * pick(maps, radius + 1)
