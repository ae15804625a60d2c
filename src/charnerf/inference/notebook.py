"""A character to be turned in a notebook: a picture, and sliders that render it anew."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from PIL import Image

from charnerf.errors import DependencyError
from charnerf.pictures import on_white, to_bytes

FROM_ANGLE_DEG, FROM_ABOVE_DEG = 30, 10  # at first
STEEPEST_DEG = 80
RESTING_SECONDS = 0.3  # without a move: now it is worth to look closely

Look = Callable[[int, int], np.ndarray]
"""Gives RGBA floats (size, size, 4) in [0, 1], straight alpha, at an azimuth and an elevation, degrees."""


def turning(moving: Look, still: Look, *, size: int) -> Any:
    """A widget that shows what is seen at the azimuth and elevation of its sliders.

    Args:
        moving: What is shown while a slider moves.
        still: What is shown where they rest; always, where no event loop runs that could wait for that.
        size: Side of the picture, pixels.

    Raises:
        DependencyError: If ipywidgets is missing.
    """
    try:
        import ipywidgets
    except ImportError as error:
        raise DependencyError(
            "hero.view: found no package ipywidgets, expected it for sliders in a notebook; install it by"
            " `pip install 'charnerf[notebook]'`, or look at hero.baked().render(azimuth_deg=45)."
        ) from error
    slider = {"continuous_update": True, "layout": ipywidgets.Layout(width=f"{max(size, 256)}px")}
    azimuth = ipywidgets.IntSlider(FROM_ANGLE_DEG, 0, 359, description="azimuth", **slider)
    elevation = ipywidgets.IntSlider(
        FROM_ABOVE_DEG, -STEEPEST_DEG, STEEPEST_DEG, description="elevation", **slider
    )
    picture = ipywidgets.Image(format="png", width=size, height=size)

    resting: list[asyncio.TimerHandle] = []

    def show(look: Look) -> None:
        picture.value = _png(look(azimuth.value, elevation.value))

    def moved(change: object) -> None:
        while resting:
            resting.pop().cancel()
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            show(still)
            return
        show(moving)
        resting.append(loop.call_later(RESTING_SECONDS, show, still))

    for one in (azimuth, elevation):
        one.observe(moved, names="value")
    show(still)
    return ipywidgets.VBox([picture, azimuth, elevation])


def _png(rgba: np.ndarray) -> bytes:
    """A picture (H, W, 4) on white as a PNG file, packed little: it is sent but once."""
    file = io.BytesIO()
    Image.fromarray(to_bytes(on_white(rgba))).save(file, format="PNG", compress_level=1)
    return file.getvalue()
