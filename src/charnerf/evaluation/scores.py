"""Every metric of one view, and their means with the reasons for what is missing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from charnerf.checks import check_finite
from charnerf.evaluation import metrics
from charnerf.evaluation.angles import Record, mean_of, mean_over_characters
from charnerf.evaluation.lpips import Lpips
from charnerf.evaluation.surface_error import SURFACE_KEYS
from charnerf.losses.alex_lpips import LEAST_SIDE
from charnerf.pictures import on_white
from charnerf.types import RenderOutput

VIEW_KEYS = (
    "psnr",
    "psnr_foreground",
    "psnr_union",
    "ssim",
    "lpips",
    "lpips_vgg",
    "flip",
    "silhouette_iou",
    "haze",
)
METRIC_KEYS = VIEW_KEYS + SURFACE_KEYS


@dataclass(frozen=True)
class MethodScores:
    """One method on one character.

    Attributes:
        views: A record a view: VIEW_KEYS and ANGLE_KEYS.
        surface: SURFACE_KEYS.
        reasons: Why a key is missing.
    """

    views: Sequence[Record]
    surface: Mapping[str, float | None]
    reasons: Mapping[str, str]


def missing_scores(reason: str) -> MethodScores:
    """The scores of a method that could not be had."""
    return MethodScores(views=(), surface={}, reasons=dict.fromkeys(METRIC_KEYS, reason))


def to_cpu(output: RenderOutput, *, name: str) -> RenderOutput:
    """A rendering on the CPU in float32, clamped to [0, 1] after the check that it is finite.

    Raises:
        NumericalError: If it holds NaN or infinity; the message names the picture.
    """
    moved = output.to("cpu", torch.float32)
    check_finite(f"{name}: rgb", moved.rgb)
    check_finite(f"{name}: opacity", moved.opacity)
    return RenderOutput(moved.rgb.clamp(0.0, 1.0), moved.opacity.clamp(0.0, 1.0), moved.depth)


def score_views(
    predictions: Mapping[str, Sequence[RenderOutput]], images: Tensor, lpips: Lpips
) -> dict[str, list[dict[str, float | None]]]:
    """VIEW_KEYS of every method's predictions (n) against the true bytes (n, H, W, 4)."""
    scores = [
        _score_view(view, image, lpips) for *view, image in zip(*predictions.values(), images, strict=True)
    ]
    return dict(zip(predictions, map(list, zip(*scores, strict=True)), strict=True))


def missing_reasons(scores: Sequence[Record], lpips: Lpips) -> dict[str, str]:
    """Why a key of VIEW_KEYS is missing in a view's scores."""
    reasons = {
        "lpips": f"the pictures have fewer than {LEAST_SIDE} pixels a side",
        "lpips_vgg": lpips.vgg_reason or f"the pictures have fewer than {LEAST_SIDE} pixels a side",
        "psnr_foreground": "no pixel has a true alpha above 0.5",
        "psnr_union": "neither picture shows anything",
        "haze": "the picture is empty",
    }
    missing = {key for each in scores for key, value in each.items() if value is None}
    return {key: str(reason) for key, reason in reasons.items() if key in missing}


def _score_view(
    predictions: Sequence[RenderOutput], image: Tensor, lpips: Lpips
) -> list[dict[str, float | None]]:
    """The scores of every method at one view."""
    rgba = image.float() / 255.0
    truth, alpha = on_white(rgba), rgba[..., 3]
    distances = lpips.of_all([one.rgb for one in predictions], truth)
    return [
        _score(prediction, truth, alpha) | distance
        for prediction, distance in zip(predictions, distances, strict=True)
    ]


def _score(prediction: RenderOutput, truth: Tensor, alpha: Tensor) -> dict[str, float | None]:
    """The scores of a picture that need no network."""
    return {
        "psnr": metrics.psnr(prediction.rgb, truth),
        "psnr_foreground": metrics.psnr_foreground(prediction.rgb, truth, alpha),
        "psnr_union": metrics.psnr_union(prediction.rgb, truth, prediction.opacity, alpha),
        "ssim": metrics.ssim(prediction.rgb, truth),
        "flip": metrics.flip(prediction.rgb, truth),
        "silhouette_iou": metrics.silhouette_iou(prediction.opacity, alpha),
        "haze": metrics.haze(prediction.opacity),
    }


def summarize(characters: Sequence[MethodScores]) -> dict[str, Any]:
    """Means over a character's views, then over characters; null with `<key>_reason` where there is none."""
    means = mean_over_characters([scores.views for scores in characters], VIEW_KEYS)
    means |= mean_of([scores.surface for scores in characters], SURFACE_KEYS)
    summary: dict[str, Any] = {}
    for key, mean in means.items():
        summary[key] = mean
        if mean is None:
            reasons = [scores.reasons[key] for scores in characters if key in scores.reasons]
            summary[f"{key}_reason"] = reasons[0] if reasons else "no view was evaluated"
    return summary
