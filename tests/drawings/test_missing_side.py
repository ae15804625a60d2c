"""A side that nobody drew is guessed, so that something bounds the depth; where a side is drawn nothing is guessed."""

import numpy as np
import pytest
from PIL import Image

from charnerf.drawings.missing_side import LEAST, MOST, ROUNDNESS, guessed_side, missing_side
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import side_missing, viewpoint
from support.painted import paint

SIDE = 128
RED, BLUE, GREEN = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9), (0.1, 0.8, 0.1)


def painted(view: str, width: int = 260) -> np.ndarray:
    return np.asarray(paint(view).resize((width, 260), Image.Resampling.BOX))


def column(width: float, color=RED) -> np.ndarray:
    """A figure 100 rows tall, as wide everywhere."""
    canvas = np.zeros((SIDE, SIDE, 4), np.float32)
    half = round(width / 2)
    canvas[14:114, SIDE // 2 - half : SIDE // 2 + half] = (*color, 1.0)
    return canvas


def depths(side: np.ndarray) -> np.ndarray:
    return side[14:114, :, 3].sum(axis=1)


@pytest.mark.parametrize("azimuth", [30.0, 45.0, 60.0, 135.0, 315.0])
@pytest.mark.parametrize("depth", [24.0, 40.0, 50.0])
def test_an_ellipse_seen_from_between_is_as_deep_as_it_is(azimuth, depth):
    cosine, sine = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
    seen = np.hypot(40.0 * cosine, depth * sine)
    side = guessed_side({0.0: column(40.0), azimuth: column(seen)}, 270.0 if sine < 0 else 90.0)
    np.testing.assert_allclose(depths(side), depth, atol=3.0 / sine**2)


def test_what_can_not_be_is_bounded():
    thin, thick = (guessed_side({0.0: column(40.0), 45.0: column(seen)}, 90.0) for seen in (8.0, 120.0))
    np.testing.assert_allclose(depths(thin), LEAST * 40.0, atol=0.5)
    assert depths(thick).max() <= MOST * 40.0 + 0.5


def test_without_a_view_between_depth_is_in_proportion_and_arms_are_no_depth():
    front = column(20.0)
    front[30:40, 5:-5] = (*GREEN, 1.0)
    side = guessed_side({0.0: front}, 90.0)
    np.testing.assert_allclose(depths(side), ROUNDNESS * 20.0, atol=0.5)
    np.testing.assert_allclose(side[35, SIDE // 2, :3], GREEN)
    assert not side[:14, :, 3].any() and not side[114:, :, 3].any()


@pytest.mark.parametrize(("azimuth", "ahead"), [(90.0, slice(0, 58)), (270.0, slice(70, SIDE))])
def test_colours_are_those_of_the_view_that_sees_the_place(azimuth, ahead):
    views = {
        0.0: column(40.0, RED),
        azimuth + (-45.0 if azimuth < 180 else 45.0): column(40.0, BLUE),
        180.0: column(40.0, GREEN),
    }
    side = guessed_side(views, azimuth)
    row, opaque = side[64, :, :3], side[64, :, 3] > 0.5
    np.testing.assert_allclose(row[SIDE // 2], BLUE)
    front, back = (np.isclose(row, color).all(axis=-1) & opaque for color in (RED, GREEN))
    assert front.any() and back.any()
    assert not front[~np.isin(np.arange(SIDE), np.arange(SIDE)[ahead])].any(), (
        "the front's colours lie where it looks"
    )


@pytest.mark.parametrize(
    ("views", "missing"),
    [
        (("front", "back"), "left"),
        (("front", "45"), "left"),
        (("front", "315", "back"), "right"),
        (("back", "135"), "left"),
        (("front", "left", "back"), None),
        (("front", "70"), None),  # from a side, nearly
        (("front", "45", "315"), None),  # two views from between bound the depth
        (("45", "135"), None),  # nothing to guess from
        (("front", "back", "0,60"), None),  # so does one from above
    ],
)
def test_which_side_is_missing(views, missing):
    found = side_missing([viewpoint(view) for view in views])
    assert (found and found.name) == missing


def test_drawings_without_a_side_get_one_and_say_so():
    drawings = {viewpoint(view): painted(view) for view in ("front", "back")}
    read = read_views(drawings, size=64)
    assert read.names == ("front", "back", "left, guessed")
    assert any("the left side: is not drawn: it was guessed" in one for one in read.warnings)
    assert not any("guessed" in one for one in read.assumptions), "what was given is told alone"
    widths = (read.views.images[0, :, 3] > 0.5).any(dim=1).sum(dim=1)
    assert widths[2] < widths[0]
    as_drawn = read_views(drawings, size=64, options=ReadingOptions(reconciled=False))
    assert as_drawn.names == ("front", "back")


def test_a_guess_stands_for_the_view_that_it_was_made_of():
    front = np.asarray(paint("front"))
    narrow = np.asarray(paint("front").resize((800, 1040), Image.Resampling.BOX))
    read = read_views(
        {viewpoint("front"): front, viewpoint("315"): narrow, viewpoint("back"): painted("back")},
        size=64,
    )
    assert read.names == ("front", "right, guessed", "back")


def test_nothing_is_guessed_beside_a_side():
    assert (
        missing_side(
            {viewpoint(view): painted(view) / 255.0 for view in ("front",)}
            | {viewpoint("left"): column(20.0)}
        )
        is None
    )


def test_a_three_quarter_view_given_as_the_side_is_noticed():
    views = {viewpoint("front"): painted("front"), viewpoint("right"): painted("front", 220)}
    doubts = [str(one) for one in read_views(views, size=64).doubts]
    assert any("nearly the front's" in one and "--view 315=FILE" in one for one in doubts)
    views[viewpoint("right")] = painted("side")[:, ::-1].copy()
    assert not any("nearly the front's" in str(one) for one in read_views(views, size=64).doubts)
