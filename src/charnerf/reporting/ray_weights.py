"""Entropy of ray weights and error of the depth, the analysis that the paper promises of its surface loss."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.data.characters import Character
from charnerf.errors import CharNeRFError
from charnerf.evaluation.ray_weights import NUM_SAMPLES, RAY_WEIGHTS_FILE, STEP, RayWeights, ray_weights
from charnerf.inference.model import Model
from charnerf.reporting.blocks import Block, Bullets, Heading, Picture, Table, Text
from charnerf.reporting.formats import NONE
from charnerf.reporting.plots import plot_lines
from charnerf.reporting.rows import Row
from charnerf.reporting.runs import Run, measured

CHARACTERS = 6
TITLE = "How sharp the surface is, and where it stands"
_SHARE, _BEHIND = "share of the rays", "metres behind the true surface"
_HULL = "visual hull (its front)"


def ray_weights_of(run: Run, *, trusted: Sequence[str] = ()) -> RayWeights:
    """The figures of a run over its first test characters.

    Raises:
        CharNeRFError: If weights or data are gone, no character has a mesh, or the model shows nothing.
    """

    def measure(model: Model, characters: Sequence[Character]) -> RayWeights:
        return ray_weights(model.network, model.renderer, characters)

    return measured(
        run,
        RAY_WEIGHTS_FILE,
        RayWeights,
        measure,
        what="figures of ray weights",
        num_characters=CHARACTERS,
        trusted=trusted,
    )


def sharpness(rows: Sequence[Row], folder: Path, *, trusted: Sequence[str] = ()) -> list[Block]:
    """Table and diagrams over the first run of every row; rows that can not be measured are named with the reason."""
    figures: dict[str, RayWeights] = {}
    problems: dict[str, list[str]] = {}
    for row in rows:
        try:
            figures[row.label] = ray_weights_of(row.runs[0], trusted=trusted)
        except CharNeRFError as error:
            problems.setdefault(str(error), []).append(row.label)
    lines = [f"{', '.join(labels)}: {problem}" for problem, labels in problems.items()]
    left: list[Block] = [Text("Not measured:"), Bullets(lines)] if lines else []
    if not figures:
        return [Heading(TITLE), *left]
    return [Heading(TITLE), _table(figures), Text(_method(figures)), *_pictures(figures, folder), *left]


def _table(figures: dict[str, RayWeights]) -> Table:
    header = ["row", "entropy ↓", "depth error ↓ cm", "depth offset, cm", "opaque ↑", "rays"]
    cells = [
        [
            label,
            f"{one.entropy:.3f}",
            f"{100.0 * one.depth_error_m:.2f}",
            f"{100.0 * one.depth_offset_m:+.2f}",
            f"{one.opaque_share:.1%}",
            f"{one.num_rays:,}",
        ]
        for label, one in figures.items()
    ]
    hull = next((one for one in figures.values() if one.hull_depth_error_m is not None), None)
    if hull is not None and hull.hull_depth_error_m is not None:
        cells.append([_HULL, NONE, f"{100.0 * hull.hull_depth_error_m:.2f}", NONE, NONE, NONE])
    return Table(header, cells)


def _method(figures: dict[str, RayWeights]) -> str:
    names = next(iter(figures.values())).characters
    return (
        f"Test characters: {', '.join(names)}. Rays that meet the captured mesh and at which the field is opaque (their share"
        f" stands under opaque); {NUM_SAMPLES} even samples on the part inside the hull, alike for all rows. Entropy of a ray's"
        " weights over the largest possible: 0 if one sample holds all, 1 if all hold the same. Depth is the expected one along"
        " the ray, the truth is the captured mesh's; a negative offset lies in front of it. The hull's depth is that of its first"
        " occupied step, a lower bar: a field that says no more than the silhouettes reaches it."
    )


def _pictures(figures: dict[str, RayWeights], folder: Path) -> list[Block]:
    by_distance = {label: [(one.distances_m, one.weight_at)] for label, one in figures.items()}
    by_share = {
        "entropy of the weights": {label: [(one.shares, one.entropy_at)] for label, one in figures.items()},
        "depth error, m": {label: [(one.shares, one.error_at)] for label, one in figures.items()},
    }
    title = f"mean weight in {100.0 * STEP:.0f} cm"
    weights = plot_lines({title: by_distance}, folder / "report_ray_weights.png", x=_BEHIND)
    shares = plot_lines(by_share, folder / "report_depth.png", x=_SHARE)
    return [
        Picture(weights, "Where the weight of a ray lies: at 0 is the captured surface"),
        Picture(shares, "Entropy and depth error that a share of the rays stays below"),
    ]
