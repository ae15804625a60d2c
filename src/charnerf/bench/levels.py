"""How much views that were drawn one by one cost, by how far they disagree: error against seconds by level."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

from charnerf.bench.subjects import TARGET_VIEWS
from charnerf.capture.generated import generate_dataset
from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.drawings.artist import LEVELS
from charnerf.drawings.redrawn import redrawn
from charnerf.evaluation.character import OURS, CharacterResult, measure_character
from charnerf.evaluation.frames import fixed_views
from charnerf.evaluation.lpips import Lpips
from charnerf.evaluation.scores import summarize
from charnerf.models.charnerf import CharNeRF
from charnerf.volume.renderers.base import AbstractRenderer

VIEWS = 4  # of a character
METRICS = ("psnr", "psnr_foreground", "ssim", "lpips", "silhouette_iou", "haze")


def characters_of(data: Path | None, split: str, count: int, *, folder: Path, size: int) -> list[Character]:
    """The first characters of a split; embedded ones, captured into a folder, without a data set."""
    if data is None:
        generate_dataset(folder, 0, 0, count, 0, views=TARGET_VIEWS, size=size, processes=1)
        data, split = folder, "test"
    return [load_character(data, name) for name in names_of(read_dataset(data), split)[:count]]


def drawn_levels(
    network: CharNeRF,
    renderer: AbstractRenderer,
    characters: Sequence[Character],
    levels: Sequence[int] = range(len(LEVELS)),
) -> list[dict[str, Any]]:
    """Measure a model on source views drawn at every level of disagreement, read and reconciled as a user's are.

    Args:
        network: In eval mode.
        renderer: Draws its scenes.
        characters: With their meshes.
        levels: Of disagreement, indices into `artist.LEVELS`.

    Returns:
        A row a level: means of every metric and of the seconds of encoding and of a picture.
    """
    measure = partial(measure_character, network, renderer, baselines=False, lpips=Lpips())
    rows = []
    for level in levels:
        drawn = [redrawn(one, level=level, seed=0, size=network.image_size) for one in characters]
        rows.append({"level": level, **_means([measure(one, fixed_views(one, VIEWS)) for one in drawn])})
    return rows


def _means(results: Sequence[CharacterResult]) -> dict[str, Any]:
    """Over a character's views, then over characters."""
    means = summarize([one.scores[OURS] for one in results])
    seconds = {
        f"{stage}_seconds": fmean(fmean(one.seconds[stage]) for one in results)
        for stage in ("encode", "render")
    }
    return {**{name: means[name] for name in METRICS}, **seconds}
