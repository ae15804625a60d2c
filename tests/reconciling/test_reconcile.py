"""Views that disagree are made to agree; views that agree are left as they are."""

import numpy as np
import pytest

from charnerf.reconciling import reconcile
from charnerf.reconciling.agreement import iou, share_apart
from charnerf.reconciling.heights import row_offsets
from charnerf.reconciling.registration import SIDE, filled, find_flow, resized, warped

SKIN, SHIRT, TROUSERS, SHOES = (0.9, 0.7, 0.6), (0.2, 0.5, 0.8), (0.3, 0.25, 0.2), (0.1, 0.1, 0.1)


def figure(
    side: int = SIDE, *, arm_deg: float = 30.0, shift: float = 0.0, stretch: float = 1.0
) -> np.ndarray:
    """A person of bands of colour with one raised arm on the picture's left; heights may be stretched from the floor."""
    y, x = (np.mgrid[:side, :side] + 0.5) / side
    x, y = x - 0.5 - shift, 0.94 - (0.94 - y) / stretch
    rgba = np.zeros((side, side, 4), np.float32)

    def paint(mask: np.ndarray, color: tuple[float, float, float]) -> None:
        rgba[mask] = (*color, 1.0)

    for sign in (-1.0, 1.0):
        angle = np.radians(arm_deg if sign < 0 else 25.0)
        along = sign * (x - sign * 0.09) * np.sin(angle) + (y - 0.3) * np.cos(angle)
        across = sign * (x - sign * 0.09) * np.cos(angle) - (y - 0.3) * np.sin(angle)
        paint((np.abs(across) < 0.025) & (along > 0) & (along < 0.3), SKIN)
        paint((np.abs(x - sign * 0.05) < 0.035) & (y > 0.55) & (y < 0.9), TROUSERS)
        paint((np.abs(x - sign * 0.05) < 0.04) & (y >= 0.9) & (y < 0.94), SHOES)
    paint((np.abs(x) < 0.1) & (y > 0.26) & (y < 0.55), SHIRT)
    paint(np.hypot(x, y - 0.19) < 0.08, SKIN)
    return rgba


def mirrored(rgba: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(rgba[:, ::-1])


def test_views_that_agree_stay_bit_for_bit():
    front = figure()
    canvases = [front, figure(arm_deg=5.0), mirrored(front)]
    found = reconcile(canvases, [0.0, 90.0, 180.0])
    for given, kept in zip(canvases, found.apply(canvases), strict=True):
        assert kept is given


@pytest.mark.parametrize("arm_deg", [15.0, 45.0, 60.0])
def test_the_back_takes_the_mirrored_fronts_outline(arm_deg):
    front, back = figure(), mirrored(figure(arm_deg=arm_deg, shift=0.01))
    found = reconcile([front, figure(), back], [0.0, 90.0, 180.0])
    view = found.views[2]
    assert view.partner == 0 and view.is_mended and view.is_trusted
    assert view.iou_after > view.iou_before
    mended = found.apply([front, figure(), back])[2]
    np.testing.assert_array_equal(mended[..., 3], front[:, ::-1, 3])
    inside = front[:, ::-1, 3] > 0.5
    error = np.abs(mended[..., :3] - front[:, ::-1, :3])[inside].mean()
    assert error < 0.04, "colours end where the front has them"


def test_the_right_side_follows_the_left_one():
    found = reconcile([figure(), figure(arm_deg=5.0), mirrored(figure(arm_deg=20.0))], [0.0, 90.0, 270.0])
    assert found.views[2].partner == 1 and found.views[2].is_mended
    assert not found.views[1].is_mended


def test_a_reconciliation_serves_any_size():
    """What was found on small canvases moves large ones to the same place."""
    found = reconcile([figure(), figure(), mirrored(figure(arm_deg=50.0))], [0.0, 90.0, 180.0])
    large = [figure(512), figure(512), mirrored(figure(512, arm_deg=50.0))]
    small = [resized(one, SIDE) for one in large]
    mended, coarse = found.apply(large)[2], found.apply(small)[2]
    assert mended.shape == (512, 512, 4)
    np.testing.assert_array_equal(mended[..., 3], large[0][:, ::-1, 3])
    inside = coarse[..., 3] > 0.99
    assert np.abs(resized(mended, SIDE) - coarse)[inside].mean() < 0.03


def test_what_is_of_another_design_is_not_trusted():
    blob = np.zeros((SIDE, SIDE, 4), np.float32)
    blob[100:120, 4:124] = 1.0
    view = reconcile([figure(), figure(), blob], [0.0, 90.0, 180.0]).views[2]
    assert view.is_mended and not view.is_trusted


@pytest.mark.parametrize("flip", [False, True])
def test_a_copy_of_the_front_is_noticed(flip):
    back = mirrored(figure()) if flip else figure()
    assert reconcile([figure(), figure(arm_deg=5.0), back], [0.0, 90.0, 180.0]).views[2].copies == 0
    other = figure()
    other[other[..., 2] > 0.7] = (0.8, 0.1, 0.1, 1.0)
    assert reconcile([figure(), figure(), mirrored(other)], [0.0, 90.0, 180.0]).views[2].copies is None


def test_rows_are_brought_to_the_fronts_heights():
    """A view drawn with longer legs: waist and soles come to where the front has them."""
    front, side = figure(), figure()
    rows = np.arange(SIDE)
    drawn = np.interp(
        rows, [20, 80, 120], [20, 75, 120]
    )  # this view shows row drawn[y] of the character at y
    side = warped(
        side,
        np.stack((np.repeat(((drawn - rows) / SIDE)[:, None], SIDE, 1), np.zeros((SIDE, SIDE)))).astype(
            np.float32
        ),
    )
    offsets = row_offsets(front, side)
    assert offsets is not None
    there = (front[..., 3] > 0.5).any(axis=1)
    read = np.interp(rows + SIDE * offsets, rows, drawn)
    assert np.abs(read - rows)[there].mean() < 0.5 * np.abs(drawn - rows)[there].mean()
    assert (np.diff(rows + SIDE * offsets) >= 0).all(), "no row passes another"


def test_equal_views_have_no_offsets():
    assert row_offsets(figure(), figure()) is None


def test_a_flow_to_itself_is_none():
    flow = find_flow(figure(), figure())
    assert np.abs(flow).max() < 0.25 / SIDE


def test_warping_by_a_shift():
    flow = np.zeros((2, SIDE, SIDE), np.float32)
    flow[1] = -4.0 / SIDE  # each pixel takes what is four pixels to its left
    np.testing.assert_allclose(warped(figure(), flow)[:, 8:], figure()[:, 4:-4], atol=1e-5)


def test_filling_keeps_colors_and_takes_the_nearest_elsewhere():
    rgba = np.zeros((SIDE, SIDE, 4), np.float32)
    rgba[40:80, 40:60] = (1.0, 0.0, 0.0, 1.0)
    rgba[40:80, 60:80] = (0.0, 0.0, 1.0, 1.0)
    alpha = np.zeros((SIDE, SIDE), np.float32)
    alpha[30:90, 30:90] = 1.0
    found = filled(rgba, alpha)
    np.testing.assert_array_equal(found[..., 3], alpha)
    np.testing.assert_array_equal(found[60, 32, :3], (1.0, 0.0, 0.0))
    np.testing.assert_array_equal(found[60, 88, :3], (0.0, 0.0, 1.0))
    np.testing.assert_array_equal(found[40:80, 40:80, :3], rgba[40:80, 40:80, :3])


def test_what_lies_apart_is_what_is_far():
    first = np.zeros((128, 128))
    first[20:100, 40:80] = 1.0
    assert share_apart(first, np.roll(first, 1, axis=1)) == 0.0
    moved = np.roll(first, 10, axis=1)
    # of 10 columns on either side all but one are farther than a pixel
    assert share_apart(first, moved) == pytest.approx(18 / 50, abs=0.01)
    assert share_apart(first, np.zeros_like(first)) == 1.0
    assert share_apart(np.zeros_like(first), np.zeros_like(first)) == 0.0
    assert iou(first, moved) == pytest.approx(30 / 50)


def test_what_hulls_are_carved_from_is_given_only_where_views_disagree():
    agreeing = [figure(), mirrored(figure())]
    assert reconcile(agreeing, [0.0, 180.0]).widened_alphas(agreeing) is None
    side = figure()
    side[:30] = 0.0  # no head
    views = [figure(), side]
    found = reconcile(views, [0.0, 90.0])
    widened = found.widened_alphas(found.apply(views))
    assert widened is not None and np.array_equal(widened[0], views[0][..., 3])
    assert (widened[1] >= found.apply(views)[1][..., 3]).all()
    assert widened[1][:30].sum() > 0


def test_a_view_from_above_is_left_as_it_is_and_carves_only_where_the_others_agree():
    above = figure(stretch=0.8)
    agreeing = [figure(), mirrored(figure()), above]
    found = reconcile(agreeing, [0.0, 180.0, 45.0], [0.0, 0.0, 40.0])
    assert found.apply(agreeing)[2] is above and found.widened_alphas(agreeing) is None
    headless = figure()
    headless[:30] = 0.0
    views = [figure(), headless, above]
    found = reconcile(views, [0.0, 90.0, 180.0], [0.0, 0.0, 40.0])
    widened = found.widened_alphas(found.apply(views))
    assert found.views[2].partner is None and widened is not None and (widened[2] == 1.0).all()
