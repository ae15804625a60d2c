"""What is taken for dirt around a figure, and what is not."""

from pathlib import Path

import numpy as np
import pytest

from charnerf.doctor.figure import figure_findings
from charnerf.doctor.views import View

VIEW = View("000", Path("000.png"), "frames[0]", np.eye(4), (1.0, 1.0), (16.0, 16.0), (32, 32))


def figure() -> np.ndarray:
    alpha = np.zeros((32, 32))
    alpha[6:26, 12:20] = 1.0
    return alpha


def found(alpha: np.ndarray) -> list[str]:
    rgba = np.concatenate((np.zeros((32, 32, 3)), 255.0 * alpha[..., None]), axis=-1).astype(np.uint8)
    return [one.found for one in figure_findings(VIEW, rgba, alpha)]


@pytest.mark.parametrize("opaque", [(2,), (2, 3), (2, 5)])
def test_a_staff_thinner_than_a_pixel_is_part_of_the_figure(opaque: tuple[int, ...]) -> None:
    """It is opaque only where it lies in the middle of a pixel; soft pixels join it to the hand."""
    alpha = figure()
    alpha[16, 2:12] = 0.3
    alpha[16, list(opaque)] = 0.9
    assert found(alpha) == []


def test_what_nothing_joins_to_the_figure_is_dirt() -> None:
    alpha = figure()
    alpha[16, 2] = alpha[28, 30] = 1.0
    alpha[17, 3:8] = 0.02  # fainter than the edge of anything
    assert found(alpha) == ["2 opaque specks apart from the figure, 2 pixels"]
    alpha[28, 30] = 0.0
    assert found(alpha) == ["1 opaque speck apart from the figure, 1 pixel"]
