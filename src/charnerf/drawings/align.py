"""Figures brought to one height, one floor line and one axis, and set on the canvas that captures use.

Letters: H, W of a drawing; S side of the canvas. A figure's box is measured below the pixel: along each axis
it ends where the greatest alpha of a row or column passes one half between two pixel centres.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from charnerf.errors import DataError
from charnerf.geometry.framing import framing_radius
from charnerf.geometry.world import HEIGHT


@dataclass(frozen=True)
class FigureBox:
    """Where a figure is in its picture, pixels, x right and y down; edges, not pixel centres."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def height(self) -> float:
        """From crown to floor line, pixels."""
        return self.bottom - self.top

    @property
    def axis(self) -> float:
        """The figure's vertical axis: the middle of its box, pixels from the left."""
        return 0.5 * (self.left + self.right)


def figure_box(alpha: np.ndarray, name: str) -> FigureBox:
    """Box of a figure by its alpha (H, W).

    Raises:
        DataError: If there is no figure, or one too small to be of use.
    """
    left, right = _ends(alpha.max(axis=0))
    top, bottom = _ends(alpha.max(axis=1))
    box = FigureBox(left, top, right, bottom)
    if not box.height >= 8.0:
        raise DataError(
            f"{name}: found a figure {box.height:.0f} pixels tall, expected at least 8 (a few hundred are "
            "good). Use a larger one."
        )
    return box


def on_one_scale(cutouts: Sequence[np.ndarray], names: Sequence[str], size: int) -> list[np.ndarray]:
    """Figures RGBA (H, W, 4) on canvases (S, S, 4) of one scale, floor line and axis.

    Raises:
        DataError: If one is no figure, or too small; the message has its name.
    """
    boxes = [figure_box(rgba[..., 3], name) for rgba, name in zip(cutouts, names, strict=True)]
    extent = half_extent([(rgba[..., 3], box) for rgba, box in zip(cutouts, boxes, strict=True)])
    return [place(rgba, box, extent=extent, size=size) for rgba, box in zip(cutouts, boxes, strict=True)]


def half_extent(figures: list[tuple[np.ndarray, FigureBox]]) -> float:
    """Half the side of the canvas, m, that captures of these figures (alpha, box) would have.

    The greatest distance from the character's middle to any covered pixel of any view, with the captures'
    margin.
    """
    reach = 0.0
    for alpha, box in figures:
        metres = HEIGHT / box.height
        rows, columns = np.nonzero(alpha > 0.5)
        across = np.maximum(np.abs(columns + 0.5 - box.axis), 0.0) + 0.5
        up = box.bottom - (rows + 0.5)
        from_middle = np.hypot(across * metres, up * metres - 0.5 * HEIGHT)
        reach = max(reach, float(from_middle.max()))
    return framing_radius(reach)


def place(rgba: np.ndarray, box: FigureBox, *, extent: float, size: int) -> np.ndarray:
    """Resample a figure onto the canvas.

    Args:
        rgba: (H, W, 4) in [0, 1], straight alpha.
        box: Where the figure is.
        extent: Half the canvas' side, m; its middle is 1 m above the floor line on the figure's axis.
        size: S, pixels.

    Returns:
        (S, S, 4) float32, straight alpha, resampled with antialiasing on premultiplied colours.
    """
    scale = box.height / HEIGHT  # source pixels per metre
    side = 2.0 * extent * scale
    x, y = box.axis - 0.5 * side, box.bottom - 0.5 * HEIGHT * scale - 0.5 * side
    height, width = rgba.shape[:2]
    # the window may reach beyond the picture: pad with clear pixels, with room for the filter
    pad = [int(np.ceil(max(0.0, over))) + 4 for over in (-y, y + side - height, -x, x + side - width)]
    premultiplied = rgba.astype(np.float32).copy()
    premultiplied[..., :3] *= premultiplied[..., 3:]
    padded = np.pad(premultiplied, ((pad[0], pad[1]), (pad[2], pad[3]), (0, 0)))
    window = (x + pad[2], y + pad[0], x + pad[2] + side, y + pad[0] + side)
    channels = [
        np.asarray(Image.fromarray(padded[..., c]).resize((size, size), Image.Resampling.BICUBIC, box=window))
        for c in range(4)
    ]
    canvas = np.stack(channels, axis=-1)
    alpha = canvas[..., 3:].clip(0.0, 1.0)
    alpha = np.where(alpha < 0.5 / 255.0, 0.0, alpha)
    color = (canvas[..., :3] / np.maximum(alpha, 1e-3)).clip(0.0, 1.0)
    return np.concatenate((np.where(alpha > 0, color, 0.0), alpha), axis=-1).astype(np.float32)


def _ends(profile: np.ndarray) -> tuple[float, float]:
    """Where a profile first rises above one half and last falls below it, in pixels from the start."""
    above = np.flatnonzero(profile > 0.5)
    if len(above) == 0:
        return 0.0, 0.0
    padded = np.concatenate(([0.0], profile.astype(np.float64), [0.0]))
    first, last = above[0] + 1, above[-1] + 1  # in the padded profile, whose centres lie at index - 0.5
    start = first - (padded[first] - 0.5) / (padded[first] - padded[first - 1]) - 0.5
    end = last + (padded[last] - 0.5) / (padded[last] - padded[last + 1]) - 0.5
    return float(start), float(end)
