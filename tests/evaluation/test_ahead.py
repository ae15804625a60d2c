"""On which characters a method without learning beats the model."""

from typing import Any

from charnerf.evaluation.ahead import characters_ahead
from charnerf.evaluation.scores import VIEW_KEYS, MethodScores, summarize


def scores(iou: float, union: float | None, chamfer_mm: float | None) -> dict[str, Any]:
    """Means of two views, which are what is given."""
    views = [
        dict.fromkeys(VIEW_KEYS) | {"silhouette_iou": iou + off, "psnr_union": union} for off in (-0.1, 0.1)
    ]
    surface = {"chamfer_mm": chamfer_mm, "f_score": None, "parts_lost": None}
    return summarize([MethodScores(views=views, surface=surface, reasons={})])


def test_more_is_better_but_for_distances() -> None:
    hull = {"a": scores(0.6, 10.0, 5.0), "b": scores(0.5, 12.0, 9.0), "equal": scores(0.4, 11.0, 7.0)}
    ours = {"a": scores(0.5, 11.0, 6.0), "b": scores(0.6, 11.5, 8.0), "equal": scores(0.4, 11.0, 7.0)}
    assert characters_ahead(hull, ours) == {
        "silhouette_iou": ["a"],
        "psnr_union": ["b"],
        "chamfer_mm": ["a"],
    }


def test_what_one_of_them_lacks_is_not_compared() -> None:
    hull = {"a": scores(0.6, 10.0, None), "b": scores(0.6, None, None)}
    ours = {"a": scores(0.5, 11.0, 6.0), "b": scores(0.5, 11.0, 8.0)}
    assert characters_ahead(hull, ours) == {"silhouette_iou": ["a", "b"], "psnr_union": []}
