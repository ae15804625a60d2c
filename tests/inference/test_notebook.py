"""Turning a character in a notebook: sliders render, and a missing package is said."""

import asyncio
import io
import sys

import numpy as np
import pytest
from PIL import Image

from charnerf.errors import DependencyError
from charnerf.inference import notebook
from charnerf.inference.notebook import turning


def angles_as_colors(azimuth: int, elevation: int) -> np.ndarray:
    picture = np.zeros((4, 4, 4), np.float32)
    picture[..., :] = azimuth / 359, (elevation + 80) / 160, 0.0, 1.0
    return picture


def test_each_slider_renders_anew():
    pytest.importorskip("ipywidgets", reason="needs the extra notebook")
    picture, azimuth, elevation = turning(angles_as_colors, angles_as_colors, size=4).children

    def shown() -> tuple[int, ...]:
        return Image.open(io.BytesIO(picture.value)).getpixel((1, 2))

    azimuth.value = elevation.value = 0
    assert shown() == (0, 128, 0)
    azimuth.value = 359
    assert shown() == (255, 128, 0)
    elevation.value = -80
    assert shown() == (255, 0, 0)


def test_a_slider_at_rest_is_looked_at_closely(monkeypatch):
    pytest.importorskip("ipywidgets", reason="needs the extra notebook")
    monkeypatch.setattr(notebook, "RESTING_SECONDS", 0.0)
    picture, azimuth, _ = turning(lambda a, e: angles_as_colors(0, 80), angles_as_colors, size=4).children

    def red() -> int:
        return Image.open(io.BytesIO(picture.value)).getpixel((1, 2))[0]

    async def turned() -> tuple[int, int]:
        azimuth.value = 100
        azimuth.value = 359
        moving = red()
        await asyncio.sleep(0.01)
        return moving, red()

    assert asyncio.run(turned()) == (0, 255)


def test_without_ipywidgets_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(DependencyError, match=r"charnerf\[notebook\]"):
        turning(angles_as_colors, angles_as_colors, size=4)
