"""Colours that two figures share."""

import numpy as np
import pytest

from charnerf.drawings.palette import FEW_SHARED, palette, shared_colors
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround
from support.painted import paint

RED, GREEN, BLUE = (0.8, 0.1, 0.1), (0.1, 0.6, 0.2), (0.2, 0.2, 0.9)


def figure(*colors, alpha: float = 1.0) -> np.ndarray:
    """Stripes of colours, as many rows of each."""
    rows = np.repeat(np.array(colors), 12, axis=0)
    rgb = np.broadcast_to(rows[:, None], (len(rows), 20, 3))
    return np.concatenate((rgb, np.full((len(rows), 20, 1), alpha)), axis=-1)


def test_shares_add_up():
    """All, none, or as much as there is of what both have; where a stripe lies does not matter."""
    one = palette(figure(RED, GREEN))
    assert one.sum() == pytest.approx(1.0)
    assert shared_colors(one, palette(figure(GREEN, RED))) == pytest.approx(1.0)
    assert shared_colors(one, palette(figure(BLUE))) < 0.02
    assert shared_colors(one, palette(figure(RED, BLUE))) == pytest.approx(0.5, abs=0.02)
    shade = tuple(0.93 * value for value in RED)
    assert shared_colors(palette(figure(RED)), palette(figure(shade))) > 0.5


def test_a_figure_without_paint_shares_nothing():
    assert palette(figure(RED, alpha=0.0)).sum() == 0.0
    assert shared_colors(palette(figure(RED, alpha=0.0)), palette(figure(RED))) == 0.0


def test_drawings_of_two_designs_are_warned_of():
    front, side, back = (np.asarray(paint(view)) for view in ("front", "side", "back"))
    told = read_views(turnaround(front, side, back), size=64).warnings
    assert not any("of its colours" in line for line in told)
    other = back.copy()
    other[..., :3] = 255 - other[..., :3][..., [1, 2, 0]] // 3
    told = read_views(turnaround(front, side, other), size=64).warnings
    assert sum("shares only" in line and "one character and design" in line for line in told) == 1
    assert 0.0 < FEW_SHARED < 0.375
