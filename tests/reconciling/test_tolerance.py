"""Outlines are widened in the rows, and by the pixels, that they are off; nowhere else."""

import numpy as np

from charnerf.reconciling.tolerance import TOLERANCES, tolerances, widened

BASE, S = TOLERANCES[0], 128


def bar(*runs: tuple[int, int, int, int]) -> np.ndarray:
    """An outline of rectangles (top, bottom, left, right)."""
    alpha = np.zeros((S, S))
    for top, bottom, left, right in runs:
        alpha[top:bottom, left:right] = 1.0
    return alpha


BODY = bar((20, 120, 54, 74))


def test_views_that_agree_are_not_widened():
    assert (tolerances([BODY, BODY, BODY, BODY], [0.0, 90.0, 180.0, 270.0]) == BASE).all()


def test_only_the_rows_of_a_raised_arm_are_widened():
    front = bar((20, 120, 54, 74), (50, 60, 30, 98))  # both arms out
    back = bar((20, 120, 54, 74), (50, 60, 30, 74))  # one arm missing: on the picture's right
    found = tolerances([front, BODY, back], [0.0, 90.0, 180.0])
    assert (found[:2] == BASE).all()
    widened = found[2] > BASE
    assert widened[50:60].all() and not widened[:45].any() and not widened[65:].any()
    assert found[2].max() == 32.0


def test_the_first_view_rules():
    """What a later view alone shows widens nothing: it is carved away by the first."""
    front, back = BODY, bar((20, 120, 54, 74), (50, 60, 30, 74))
    assert (tolerances([front, BODY, back], [0.0, 90.0, 180.0]) == BASE).all()


def test_a_head_that_the_side_lacks_is_kept():
    front, side = bar((10, 120, 54, 74)), BODY
    found = tolerances([front, side], [0.0, 90.0])
    assert found[1, 10:18].min() >= 2.0 and (found[1, 30:] == BASE).all()
    assert found[1, 10] >= found[1, 18], "as much as is needed: more where the outline is farther"


def test_a_view_of_something_else_carves_nothing():
    other = bar((100, 104, 4, 8))
    found = tolerances([BODY, BODY, other], [0.0, 90.0, 45.0])
    assert np.isinf(found[2]).all() and (found[:2] == BASE).all()


def test_a_three_quarter_view_of_a_cylinder_agrees():
    assert (tolerances([BODY, BODY, bar((20, 120, 50, 78))], [0.0, 90.0, 45.0]) == BASE).all()


def test_outlines_grow_by_their_rows_tolerance():
    """A body of 20 columns in rows of which some may be off by 4 pixels; at twice the size by twice as many."""
    rows = np.full(S, BASE)
    rows[50:60] = BASE + 4.0
    for factor in (1, 2):
        alpha = np.kron(BODY, np.ones((factor, factor)))
        grown = widened(alpha, rows)
        counts = grown.sum(axis=1)
        assert counts[50 * factor] == (20 + 2 * 4) * factor
        assert np.array_equal(grown[: 50 * factor], alpha[: 50 * factor])
        assert np.array_equal(grown[60 * factor :], alpha[60 * factor :])


def test_a_view_that_carves_nothing_grows_to_everything():
    assert (widened(BODY, np.full(S, np.inf)) == 1.0).all()
