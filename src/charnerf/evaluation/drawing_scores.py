"""How near drawings themselves come to the truth: what can be known of it, from where they were drawn."""

import torch
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.evaluation.lpips import Lpips
from charnerf.evaluation.scores import MethodScores, missing_reasons, missing_scores, score_views
from charnerf.evaluation.surface_error import missing_surface
from charnerf.pictures import on_white, to_bytes
from charnerf.types import RenderOutput

DRAWINGS = "drawings"


def score_drawings(drawn: Character, captured: Character, lpips: Lpips) -> MethodScores:
    """Metrics of the source views of a character as drawn against the same views as captured.

    A view that was not captured is left out.

    Args:
        drawn: With drawings for source views, as the model reads them.
        captured: The character before it was drawn.
        lpips: As of `score_views`.
    """
    names = [name for name in drawn.source_names if name in captured.source_names]
    if not names:
        return missing_scores("none of the views that were drawn was captured")
    drawings, truth = _pictures(drawn, names), _pictures(captured, names)
    if drawings.shape != truth.shape:
        return missing_scores("the captured views are of another size than the drawings that the model reads")
    alphas = drawings[..., 3]
    predictions = [
        RenderOutput(on_white(one), alpha, torch.zeros_like(alpha))
        for one, alpha in zip(drawings, alphas, strict=True)
    ]
    views = score_views({DRAWINGS: predictions}, torch.from_numpy(to_bytes(truth)), lpips)[DRAWINGS]
    surface, missing = missing_surface("drawings have no surface")
    return MethodScores(views, surface, {**missing_reasons(views, lpips), **missing})


def _pictures(character: Character, names: list[str]) -> Tensor:
    """Source views by name, RGBA (n, H, W, 4) in [0, 1]."""
    places = [character.source_names.index(name) for name in names]
    return character.sources.images[0, places].float().permute(0, 2, 3, 1).cpu()
