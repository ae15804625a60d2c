"""On which characters a method without learning comes nearer to the truth than the model."""

from collections.abc import Mapping
from typing import Any

AHEAD_KEYS = {"silhouette_iou": 1.0, "psnr_union": 1.0, "chamfer_mm": -1.0}
"""What judges a figure's shape, with the sign by which more is better; `psnr_foreground` would flatter what is too fat."""


def characters_ahead(
    theirs: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Mapping[str, Any]]
) -> dict[str, list[str]]:
    """Names of the characters on which a method is better than the model, by key of AHEAD_KEYS.

    Args:
        theirs: The method's means, as of `summarize`, by character.
        ours: The model's, of the same characters.

    Returns:
        No key where no character has both figures.
    """
    ahead: dict[str, list[str]] = {}
    for key, sign in AHEAD_KEYS.items():
        both = [name for name in ours if theirs[name][key] is not None and ours[name][key] is not None]
        if both:
            ahead[key] = [name for name in both if sign * (theirs[name][key] - ours[name][key]) > 0.0]
    return ahead
