"""The figure in its picture: there, whole, on nothing."""

from collections.abc import Iterator

import numpy as np
from scipy import ndimage

from charnerf.doctor.finding import Finding
from charnerf.doctor.views import View
from charnerf.wording import counted

FAINT = 0.05  # alpha
MOST_FAINT = 0.02  # share of a picture that may be faint: soft edges are less
CROPPED = 3  # opaque pixels of a border
WHITE = 250
BORDER_WHITE = 0.5  # share of a border that is pure white where the background is


def figure_alpha(rgba: np.ndarray, mask: np.ndarray | None) -> np.ndarray | None:
    """Alpha (H, W) in [0, 1] by alpha, mask or a white background; None where nothing tells the figure."""
    alpha = rgba[..., 3] / 255.0
    if mask is not None:
        return alpha * mask
    if (alpha < 1.0).any():
        return alpha
    white = (rgba[..., :3] == 255).all(-1)
    return (~white).astype(float) if _border(white).mean() >= BORDER_WHITE else None


def figure_findings(view: View, rgba: np.ndarray, alpha: np.ndarray | None) -> Iterator[Finding]:
    """What is wrong with a figure and what is around it."""
    where = str(view.file)
    if alpha is None:
        color = np.median(_border(rgba[..., :3]), axis=0).astype(int).tolist()
        yield Finding(
            "background that is not white", where, f"an opaque picture whose border is mostly {color}",
            "alpha, a mask, or pure white (255) around the figure", "Cut the figure out, or render it on nothing.",
            picture=rgba[..., :3],
        )  # fmt: skip
        return
    shown = alpha > 0.5
    if not shown.any():
        yield Finding(
            "empty picture", where, "no pixel that is more than half opaque", "a figure",
            "Render or export it again; its camera may look away.",
        )  # fmt: skip
        return
    faint = (alpha > 0.0) & (alpha < FAINT)
    specks = _specks(alpha)
    if faint.mean() > MOST_FAINT or specks.any():
        found = (
            f"alpha between 0 and {FAINT} on {100 * faint.mean():.0f} % of the picture"
            if faint.mean() > MOST_FAINT
            else f"{counted(ndimage.label(specks)[1], 'opaque speck')} apart from the figure, {counted(int(specks.sum()), 'pixel')}"
        )
        yield Finding(
            "dirty background", where, found, "alpha 0 around the figure", "Set what is not the figure to transparent.",
            picture=_marked(rgba, faint | specks),
        )  # fmt: skip
    touched = int(_border(shown).sum())
    if touched >= CROPPED:
        yield Finding(
            "cropped figure", where, f"{touched} pixels of the figure on the picture's border", "all of it, and room around",
            "Move the camera back, or export the picture uncropped.", "charnerf capture MESH -o DATASET --split SPLIT",
            picture=rgba[..., :3],
        )  # fmt: skip


def _specks(alpha: np.ndarray) -> np.ndarray:
    """Small opaque pieces far from the largest one, (H, W): not hands, hats or props, which are near or large.

    What soft pixels join to the figure is a part of it: a staff thinner than a pixel is opaque here and there.
    """
    shown = alpha > 0.5
    labels, count = ndimage.label(alpha >= FAINT, structure=np.ones((3, 3)))
    if count < 2:
        return np.zeros_like(shown)
    labels = labels * shown
    sizes = ndimage.sum_labels(shown, labels, range(1, count + 1))
    largest = labels == 1 + int(np.argmax(sizes))
    apart = ndimage.distance_transform_edt(~largest)
    few = max(2.0, 0.002 * shown.sum())
    return np.isin(labels, 1 + np.flatnonzero((sizes > 0) & (sizes <= few))) & (
        apart > 0.1 * max(shown.shape)
    )


def _border(values: np.ndarray) -> np.ndarray:
    return np.concatenate((values[0], values[-1], values[:, 0], values[:, -1]))


def _marked(rgba: np.ndarray, where: np.ndarray) -> np.ndarray:
    """A picture on white with some pixels in red."""
    alpha = rgba[..., 3:] / 255.0
    rgb = (rgba[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype(np.uint8)
    rgb[where] = (220, 30, 30)
    return rgb
