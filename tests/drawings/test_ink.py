"""Lines along outlines are told from paint, whatever their colour and width, and painted over; paint stays."""

import numpy as np
import pytest
from scipy import ndimage

from charnerf.drawings.ink import INKED, find_outline_ink, painted_over
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround

SIDE = 240
SKIN, SHIRT, DARK = (0.9, 0.7, 0.6), (0.3, 0.5, 0.9), (0.12, 0.11, 0.13)


def figure(
    line: int, color: tuple[float, float, float] = (0.05, 0.05, 0.07), *, dark_legs: bool = False
) -> np.ndarray:
    """A head on a body on legs, RGBA, with a line of some pixels along the outline and one across the belt."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    rgba = np.zeros((SIDE, SIDE, 4), np.float32)
    legs = (np.abs(np.abs(x - 120) - 18) < 15) & (y >= 140) & (y < 220)
    for mask, paint in (
        (np.hypot(x - 120, y - 50) < 30, SKIN),
        ((np.abs(x - 120) < 36) & (y > 76) & (y < 142), SHIRT),
        (legs, DARK if dark_legs else (0.5, 0.45, 0.4)),
    ):
        rgba[mask] = (*paint, 1.0)
    if line:
        inside = rgba[..., 3] > 0.5
        rgba[inside & ~ndimage.binary_erosion(inside, iterations=line), :3] = color
    rgba[108:111, 90:150, :3] = color
    return rgba


@pytest.mark.parametrize("line", [1, 2, 3])
@pytest.mark.parametrize("color", [(0.05, 0.05, 0.07), (0.25, 0.15, 0.1)])
def test_a_line_along_the_outline_is_painted_over_and_one_inside_stays(line, color):
    drawn, plain = figure(line, color), figure(0, color)
    ink = find_outline_ink(drawn)
    assert ink.share > 0.9
    painted, shown = painted_over(drawn, ink), drawn[..., 3] > 0.5
    before, after = (np.abs(one[..., :3] - plain[..., :3])[shown].mean() for one in (drawn, painted))
    assert after < 0.15 * before
    assert (painted[109, 100:140, :3] < 0.3).all(), "the belt's line is inner"
    assert np.array_equal(painted[..., 3], drawn[..., 3])


def test_paint_that_is_dark_is_no_ink():
    """Without lines nothing is found; dark legs are paint up to their outline, also beside inked parts."""
    assert find_outline_ink(figure(0)).share < 0.05
    assert find_outline_ink(figure(0, dark_legs=True)).share < INKED
    drawn = figure(2, dark_legs=True)
    painted = painted_over(drawn, find_outline_ink(drawn))
    assert np.abs(painted[160:215, 95:110, :3] - DARK).max() < 1e-6


def test_a_shaded_outline_is_no_line():
    """Paint that darkens slowly towards its edge, as round things do."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    distance = np.hypot(x - 120, y - 120) / 100.0
    rgba = np.zeros((SIDE, SIDE, 4), np.float32)
    rgba[distance < 1.0, 3] = 1.0
    rgba[..., :3] = np.sqrt(np.clip(1.0 - 0.8 * distance**2, 0.0, 1.0))[..., None] * SKIN
    assert find_outline_ink(rgba).share < INKED


def test_an_empty_picture_has_no_ink():
    assert find_outline_ink(np.zeros((20, 20, 4), np.float32)).share == 0.0


def test_drawings_are_read_without_their_ink_unless_it_is_kept():
    """Seen from the side an outline is the middle of the figure: there must be no black; uninked views stay bit for bit."""
    inked = {view: figure(2) for view in turnaround(0, 1, 2)}
    plain = {view: figure(0) for view in turnaround(0, 1, 2)}
    read = read_views(inked, size=128)
    kept = read_views(inked, size=128, options=ReadingOptions(keep_ink=True))
    assert any("--keep-ink" in line for line in read.assumptions)
    assert not any("--keep-ink" in line for line in kept.assumptions)
    dark = [
        (one.views.images[0, 0, :3].amax(0) < 0.3) & (one.views.images[0, 0, 3] > 0.9) for one in (read, kept)
    ]
    assert dark[0].sum() < 0.3 * dark[1].sum()
    same = [
        read_views(plain, size=128, options=ReadingOptions(keep_ink=keep)).views.images
        for keep in (True, False)
    ]
    assert (same[0] == same[1]).all()
