"""Paper that a figure encloses: gaps are seen through, what is white stays."""

import numpy as np
import pytest

from charnerf.drawings.cutout import cut_out, see_through
from charnerf.drawings.enclosed import shared
from charnerf.drawings.load import drawing_from_array
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround

SIDE, PAINT, LINE = 240, (150, 60, 40), (20, 20, 20)
BODY = (slice(20, 220), slice(90, 150))  # rows, columns
ARM = (slice(50, 140), slice(50, 110))  # beside the body, around the gap
GAP = (slice(70, 120), slice(62, 88))
EYE = (slice(30, 44), slice(95, 110))
SHIRT = (slice(60, 110), slice(96, 144))
SLEEVE = (slice(60, 130), slice(150, 190))
PAPERS = {"white": (255, 255, 255), "tinted": (246, 240, 226)}


def figure(paper, *holes, arm: bool = True, sleeve: bool = False, mirrored: bool = False) -> np.ndarray:
    """A figure with an arm akimbo to the picture's left, uint8 (SIDE, SIDE, 3), and regions of paper's colour in it."""
    picture = np.full((SIDE, SIDE, 3), paper, np.uint8)
    picture[BODY] = PAINT
    if arm:
        picture[ARM] = PAINT
        picture[GAP] = paper
    for hole in holes:
        picture[hole] = paper
    if sleeve:  # unpainted, behind a line
        picture[SLEEVE] = LINE
        rows, columns = SLEEVE
        picture[rows.start + 2 : rows.stop - 2, columns.start : columns.stop - 2] = paper
    return picture[:, ::-1].copy() if mirrored else picture


def opened(front: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Alpha of the front once the back was asked too, (SIDE, SIDE)."""
    cut = [cut_out(drawing_from_array(one, name)) for one, name in ((front, "front"), (back, "back"))]
    ours, _ = shared(cut[0].gaps, cut[1].gaps)
    return see_through(cut[0], ours).rgba[..., 3]


def inner(region) -> tuple[slice, slice]:
    """A region without the pixels that soft outlines may take."""
    return tuple(slice(one.start + 3, one.stop - 3) for one in region)


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_a_gap_that_both_sides_show_is_seen_through(paper):
    alpha = opened(figure(paper), figure(paper, mirrored=True))
    assert alpha[inner(GAP)].max() == 0.0
    assert alpha[inner((slice(70, 120), slice(50, 62)))].min() > 0.99  # the arm
    assert alpha[inner(BODY)].min() > 0.99


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_what_one_side_alone_shows_stays(paper):
    """Eyes, a mask, a buckle."""
    alpha = opened(figure(paper, EYE), figure(paper, mirrored=True))
    assert alpha[inner(EYE)].min() == 1.0 and alpha[inner(GAP)].max() == 0.0
    assert opened(figure(paper), figure(paper, arm=False))[inner(GAP)].min() == 1.0


@pytest.mark.parametrize("paper", PAPERS.values(), ids=PAPERS)
def test_unpainted_cloth_on_both_sides_stays(paper):
    """A shirt lies across the axis; a sleeve is closed off against the background by a line alone."""
    front, back = (figure(paper, SHIRT, sleeve=True, mirrored=one) for one in (False, True))
    alpha = opened(front, back)
    assert alpha[inner(SHIRT)].min() == 1.0
    assert alpha[inner((SLEEVE[0], slice(150, 186)))].min() == 1.0


def test_a_gap_at_another_place_or_of_another_size_is_none():
    lower = figure(PAPERS["white"])
    lower[GAP] = PAINT
    lower[slice(100, 130), slice(62, 88)] = PAPERS["white"]
    assert opened(figure(PAPERS["white"]), lower[:, ::-1].copy())[inner(GAP)].min() == 1.0
    tiny = figure(PAPERS["white"], mirrored=True)
    tiny[:, ::-1][GAP] = PAINT
    tiny[:, ::-1][slice(88, 102), slice(70, 80)] = PAPERS["white"]
    assert opened(figure(PAPERS["white"]), tiny)[inner(GAP)].min() == 1.0


def test_it_is_said_and_reaches_the_views():
    paper = PAPERS["tinted"]
    side = np.full((SIDE, SIDE, 3), paper, np.uint8)
    side[slice(20, 220), slice(100, 140)] = PAINT
    views = turnaround(figure(paper), side, figure(paper, mirrored=True), side_is="left")
    read = read_views(views, size=64)
    told = [line for line in read.assumptions if "1 enclosed gap of paper seen through" in line]
    assert len(told) == 2
    without = read_views(dict(list(views.items())[:2]), size=64)  # front and side: nothing shows what it is
    assert not any("seen through" in line for line in without.assumptions)
    clear = (read.views.images[0, 0, 3] < 0.05) & (without.views.images[0, 0, 3] > 0.95)
    assert 20 < int(clear.sum()) < 200
