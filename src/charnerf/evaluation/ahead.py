"""On which characters a method without learning comes nearer to the truth than the model."""

from collections.abc import Sequence

from charnerf.evaluation.scores import MethodScores, summarize

AHEAD_KEYS = {"silhouette_iou": 1.0, "psnr_union": 1.0, "chamfer_mm": -1.0}
"""What judges a figure's shape, with the sign by which more is better; `psnr_foreground` would flatter what is too fat."""


def characters_ahead(
    names: Sequence[str], method: Sequence[MethodScores], ours: Sequence[MethodScores]
) -> dict[str, list[str]]:
    """Names of the characters on which a method's mean is better than the model's, by key of AHEAD_KEYS.

    Args:
        names: Of the characters.
        method: Scores of the method, one a character.
        ours: The model's, in the same order.

    Returns:
        No key where no character has both figures.
    """
    theirs, our_own = ([summarize([scores]) for scores in each] for each in (method, ours))
    ahead: dict[str, list[str]] = {}
    for key, sign in AHEAD_KEYS.items():
        pairs = [
            (name, sign * (their[key] - own[key]))
            for name, their, own in zip(names, theirs, our_own, strict=True)
            if their[key] is not None and own[key] is not None
        ]
        if pairs:
            ahead[key] = [name for name, lead in pairs if lead > 0.0]
    return ahead
