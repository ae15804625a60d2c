"""Error of pictures and surfaces against the truth: pure functions, no state.

Pictures are sRGB-encoded in [0, 1], composited on white, (H, W, 3); opacities are (H, W). Surfaces are
point sets (N, 3), m. A picture of bytes is refused, NaN is refused: a metric of either would be a number
that means nothing.
"""

import numpy as np
import torch
from scipy import ndimage
from scipy.spatial import cKDTree
from torch import Tensor
from torch.nn import functional as F

from charnerf.checks import check_finite, check_last_dim, check_same_shape
from charnerf.errors import DataError, ShapeError

FOREGROUND_ALPHA = 0.5
"""True alpha above which a pixel counts as the character."""
F_SCORE_RADIUS_M = 0.02
"""Distance within which a surface point counts as found."""
LOST_RADIUS_M = 0.05
"""Distance beyond which a point of the true surface counts as lost: a hand, a foot, an ear."""
HAZE = (0.05, 0.95)
"""Opacities between which a pixel is neither clear nor opaque."""
HAZE_MARGIN = 2.0
"""Pixels beside an outline that may be either."""
WINDOW_RADIUS, WINDOW_SIGMA = 5, 1.5
"""Pixels around one that its structural similarity sees, and its window's deviation."""
SSIM_MEANS, SSIM_DEVIATIONS = 0.01**2, 0.03**2
"""What steadies structural similarity where means or deviations are small."""
FLIP_RADIUS = 10
"""Pixels around one that its FLIP error sees: three deviations of the widest filter at 67 pixels per degree."""
MIN_SQUARED_ERROR = 1e-10
"""Mean squared errors below this count as this: equal pictures have 100 dB, so that means stay finite."""


def check_unit_range(name: str, picture: Tensor) -> None:
    """Check that a picture holds finite numbers in [0, 1], up to rounding.

    Raises:
        NumericalError: If it holds NaN or infinity.
        DataError: If a value lies outside.
    """
    check_finite(name, picture)
    if not picture.numel():
        raise ShapeError(f"{name}: found an empty picture of shape {tuple(picture.shape)}, expected pixels.")
    low, high = (float(value) for value in torch.aminmax(picture))
    if low < -1e-4 or high > 1.0 + 1e-4:
        hint = "; divide bytes by 255" if high > 2.0 else ""
        raise DataError(f"{name}: found values from {low:g} to {high:g}, expected the range [0, 1]{hint}.")


def check_pair(prediction: Tensor, truth: Tensor) -> None:
    """Check that two pictures (H, W, 3) can be compared.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.
    """
    check_last_dim("prediction", prediction, 3)
    check_same_shape("prediction", prediction, "truth", truth)
    check_unit_range("prediction", prediction)
    check_unit_range("truth", truth)


def _decibels(squared_errors: Tensor) -> float:
    return float(-10.0 * torch.log10(squared_errors.mean().clamp_min(MIN_SQUARED_ERROR)))


def psnr(prediction: Tensor, truth: Tensor) -> float:
    """Peak signal-to-noise ratio of a whole picture, (H, W, 3) each; dB, at most 100.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.
    """
    check_pair(prediction, truth)
    return _decibels((prediction.double() - truth.double()).square())


def psnr_foreground(prediction: Tensor, truth: Tensor, true_alpha: Tensor) -> float | None:
    """Peak signal-to-noise ratio over pixels of true alpha (H, W) above 0.5; None where there is none.

    A white background flatters the whole picture's figure; this one it does not touch.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.
    """
    check_pair(prediction, truth)
    check_unit_range("true_alpha", true_alpha)
    inside = true_alpha > FOREGROUND_ALPHA
    check_same_shape("true_alpha", true_alpha, "truth[..., 0]", truth[..., 0])
    if not bool(inside.any()):
        return None
    return _decibels((prediction[inside].double() - truth[inside].double()).square())


def psnr_union(prediction: Tensor, truth: Tensor, opacity: Tensor, true_alpha: Tensor) -> float | None:
    """Peak signal-to-noise ratio over pixels that either shows, opacity or true alpha (H, W) above 0.5; None where there is none.

    What is missing and what is too much count alike: `psnr_foreground` does not see the latter, which flatters fat figures.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.
    """
    check_pair(prediction, truth)
    for name, values in (("opacity", opacity), ("true_alpha", true_alpha)):
        check_unit_range(name, values)
        check_same_shape(name, values, "truth[..., 0]", truth[..., 0])
    shown = (opacity > FOREGROUND_ALPHA) | (true_alpha > FOREGROUND_ALPHA)
    if not bool(shown.any()):
        return None
    return _decibels((prediction[shown].double() - truth[shown].double()).square())


def around_figures(prediction: Tensor, truth: Tensor, margin: int) -> tuple[slice, slice]:
    """Rows and columns of two pictures (H, W, 3) beyond which both show nothing but one colour, that of their corner.

    Errors of a pixel that sees no farther than the margin are those of the whole picture there, and none elsewhere.

    Args:
        prediction: (H, W, 3).
        truth: (H, W, 3).
        margin: Pixels that are kept around what either shows; of pictures of one colour, so many of their corner.
    """
    shown = ((prediction != truth[0, 0]) | (truth != truth[0, 0])).any(dim=-1)
    ranges = []
    for axis in (1, 0):
        places = shown.any(dim=axis).nonzero()[:, 0].tolist() or [0]
        ranges.append(slice(max(0, places[0] - margin), places[-1] + 1 + margin))
    return ranges[0], ranges[1]


def ssim(prediction: Tensor, truth: Tensor) -> float:
    """Structural similarity, Gaussian window of 11 pixels with sigma 1.5, mean over pixels and colours.

    Where both pictures show one colour alone it is 1, and not computed.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.

    Source: Wang 2004; as torchmetrics, whose import takes longer than all pictures of a character.
    """
    check_pair(prediction, truth)
    # beyond edges a picture is continued mirrored
    kept = around_figures(prediction, truth, WINDOW_RADIUS + 1)
    # in float32 the difference of squares alone would be off by 1e-5
    x, y = (picture[kept].double().movedim(-1, 0) for picture in (prediction, truth))
    mean_x, mean_y, square_x, square_y, product = window_means(torch.stack((x, y, x * x, y * y, x * y)))
    deviation = (square_x - mean_x**2).clamp_min(0.0) + (square_y - mean_y**2).clamp_min(0.0)
    alike = (2.0 * mean_x * mean_y + SSIM_MEANS) / (mean_x**2 + mean_y**2 + SSIM_MEANS)
    alike *= (2.0 * (product - mean_x * mean_y) + SSIM_DEVIATIONS) / (deviation + SSIM_DEVIATIONS)
    return 1.0 - (1.0 - float(alike.mean())) * x.numel() / truth.numel()


def window_means(maps: Tensor) -> Tensor:
    """Means of maps (..., H, W) under a Gaussian window around each pixel, as products with a matrix of each axis."""
    offsets = torch.arange(-WINDOW_RADIUS, WINDOW_RADIUS + 1, dtype=maps.dtype, device=maps.device)
    window = torch.softmax(-(offsets**2) / (2.0 * WINDOW_SIGMA**2), dim=0)

    def means(size: int) -> Tensor:
        unit = torch.eye(size, dtype=maps.dtype, device=maps.device)[None]
        mirrored = F.pad(unit, (WINDOW_RADIUS, WINDOW_RADIUS), mode="reflect")[0]
        return mirrored.unfold(-1, len(window), 1) @ window

    return means(maps.shape[-2]).t() @ maps @ means(maps.shape[-1])


def flip(prediction: Tensor, truth: Tensor) -> float:
    """Mean FLIP error of a picture, 0 (equal) to 1, at the evaluator's default of 67 pixels per degree.

    Where both pictures show one colour alone it is 0, and not computed.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.

    Source: Andersson 2020; flip-evaluator.
    """
    from flip_evaluator import evaluate

    check_pair(prediction, truth)
    kept = around_figures(prediction, truth, FLIP_RADIUS)
    test, reference = (
        np.ascontiguousarray(picture[kept].detach().clamp(0.0, 1.0).cpu().numpy(), dtype=np.float32)
        for picture in (prediction, truth)
    )
    share = test.size / truth.numel()
    return share * float(evaluate(reference, test, "LDR", applyMagma=False)[1])


def silhouette_iou(opacity: Tensor, true_alpha: Tensor) -> float:
    """Intersection over union of the silhouettes (H, W), each where it is above 0.5; 1 where both are empty.

    Raises:
        DataError: If values leave [0, 1].
        NumericalError: If values are not finite.
        ShapeError: If the shapes differ.
    """
    check_same_shape("opacity", opacity, "true_alpha", true_alpha)
    check_unit_range("opacity", opacity)
    check_unit_range("true_alpha", true_alpha)
    predicted, true = opacity > FOREGROUND_ALPHA, true_alpha > FOREGROUND_ALPHA
    union = int((predicted | true).sum())
    return int((predicted & true).sum()) / union if union else 1.0


def surface_distances(predicted: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances from predicted (N, 3) to true points and from true (M, 3) to predicted points, m.

    Raises:
        NumericalError: If a coordinate is not finite.
        ShapeError: If a set is empty or not (N, 3).
    """
    for name, points in (("predicted", predicted), ("true", true)):
        if points.ndim != 2 or points.shape[-1] != 3 or not len(points):
            raise ShapeError(f"{name}: found shape {points.shape}, expected (N, 3) with at least one point.")
        check_finite(name, torch.from_numpy(np.asarray(points, dtype=np.float64)))
    ours, theirs = cKDTree(predicted), cKDTree(true)
    return _nearest(ours, theirs), _nearest(theirs, ours)


def _nearest(points: cKDTree, others: cKDTree) -> np.ndarray:
    """Distances (N,) of a tree's points to the nearest of another's, m; asked leaf by leaf, so that caches hold what is read."""
    distances = np.full(points.n, np.inf)
    distances[points.indices] = others.query(points.data[points.indices])[0]
    return distances


def chamfer_mm(there: np.ndarray, back: np.ndarray) -> float:
    """Mean of the two mean distances (N,), (M,) of `surface_distances`, given in m; mm."""
    return float(1000.0 * 0.5 * (there.mean() + back.mean()))


def f_score(there: np.ndarray, back: np.ndarray, *, radius: float = F_SCORE_RADIUS_M) -> float:
    """Harmonic mean of the shares of the distances (N,), (M,) of `surface_distances` that are within the radius, m.

    Source: Knapitsch 2017 (Tanks and Temples).
    """
    precision, recall = float((there <= radius).mean()), float((back <= radius).mean())
    total = precision + recall
    return 2.0 * precision * recall / total if total else 0.0


def parts_lost(back: np.ndarray, *, radius: float = LOST_RADIUS_M) -> float:
    """Share of the true surface that lies farther than a radius, m, from ours, by the distances (M,) of `surface_distances`."""
    return float((back > radius).mean())


def haze(opacity: Tensor) -> float | None:
    """Share of a figure's pixels that are neither clear nor opaque, away from its outline; None where it shows nothing.

    Args:
        opacity: (H, W), in [0, 1]. The figure is where it is above HAZE[0]; hazy pixels are below HAZE[1] and farther than
            HAZE_MARGIN pixels from where it passes one half.
    """
    values = opacity.detach().cpu().numpy()
    figure = values > HAZE[0]
    if not figure.any():
        return None
    half = values > 0.5
    inner = ndimage.binary_erosion(half, border_value=1)
    outline = (half & ~inner) | (ndimage.binary_dilation(half) & ~half)
    away = ndimage.distance_transform_edt(~outline) > HAZE_MARGIN if outline.any() else np.ones_like(half)
    return float((figure & (values < HAZE[1]) & away).sum() / figure.sum())
