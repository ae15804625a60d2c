"""Depth pictures against what they belong to: their file, their picture's figure, their camera."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy import ndimage

from charnerf.doctor.finding import Finding
from charnerf.doctor.picture_files import DEPTH_AGAIN, read_depth
from charnerf.doctor.views import View
from charnerf.geometry.world import BOX_HALF_EXTENT, CENTRE

COVERED = 0.97  # of what lies well inside the one figure, by the other
EDGE = 2  # pixels at outlines, where a pixel's centre and its alpha may differ
REACH = 3.0**0.5 * BOX_HALF_EXTENT  # m, from the middle to the box's corners


def depth_findings(
    views: Sequence[View], alphas: Mapping[str, np.ndarray], *, are_right: bool
) -> Iterator[Finding]:
    """What is wrong with the depth of a character's views.

    Args:
        views: Some have none.
        alphas: Of their pictures, (H, W) in [0, 1], by the views' keys: of those that depth can be held against.
        are_right: Whether cameras and figure are known to be: distances are compared with them.
    """
    for view in views:
        if view.depth is None or not view.depth.is_file():
            continue
        depth, broken = read_depth(view.depth)
        yield from broken
        if depth is None or view.key not in alphas:
            continue
        where, figure = str(view.depth), alphas[view.key] > 0.5
        if depth.shape != figure.shape:
            sizes = [" x ".join(map(str, one.shape[::-1])) for one in (depth, figure)]
            yield _finding("unequal sizes", where, f"{sizes[0]} pixels", f"{sizes[1]} as its picture has")
            continue
        share = min(_covered(depth > 0, figure), _covered(figure, depth > 0))
        if share < COVERED:
            found = f"depth and {view.file.name} that cover {100 * share:.0f} % of one another's figure"
            yield _finding("misaligned depth", where, found, f"{100 * COVERED:.0f} % or more")
        elif are_right:
            yield from _unit_findings(view, 1e-3 * depth[depth > 0])


def _covered(first: np.ndarray, second: np.ndarray) -> float:
    """Share of a figure, its outline left out, that another one covers; 1 of one that has no inside."""
    inside = ndimage.binary_erosion(first, iterations=EDGE)
    return float(second[inside].mean()) if inside.any() else 1.0


def _unit_findings(view: View, metres: np.ndarray) -> Iterator[Finding]:
    """Whether distances are those at which the figure can stand."""
    away = float(np.linalg.norm(view.matrix[:3, 3] - np.asarray(CENTRE)))
    middle = float(np.median(metres)) if len(metres) else away
    if abs(middle - away) > REACH:
        yield _finding(
            "wrong units of depth",
            str(view.depth),
            f"distances of {middle:.3g} m in the middle",
            f"{max(away - REACH, 0.0):.2f} to {away + REACH:.2f} m, in millimetres, as its camera stands",
        )


def _finding(fault: str, where: str, found: str, expected: str) -> Finding:
    return Finding(fault, where, found, expected, "Capture it again.", DEPTH_AGAIN)
