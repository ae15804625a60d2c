"""Entropy of ray weights and error of the depth, the analysis that the paper promises of its surface loss."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.errors import CharNeRFError
from charnerf.evaluation.ray_weights import (
    NUM_SAMPLES,
    RAY_WEIGHTS_FILE,
    STEP,
    RayWeights,
    ray_weights,
    read_ray_weights,
    write_ray_weights,
)
from charnerf.inference.weights import load
from charnerf.reporting.blocks import Block, Bullets, Heading, Picture, Plot, Table, Text
from charnerf.reporting.interactive import Line, lines_figure
from charnerf.reporting.parts import NONE
from charnerf.reporting.plots import plot_lines
from charnerf.reporting.rows import Row, Run, data_root

CHARACTERS = 6
TITLE = "How sharp the surface is, and where it stands"
_SHARE, _BEHIND = "share of the rays", "metres behind the true surface"
_HULL = "visual hull (its front)"


def measure(run: Run, *, trusted: Sequence[str] = ()) -> RayWeights:
    """The figures of a run over its first test characters: read where they are newer than the weights, else made and kept.

    Raises:
        CharNeRFError: If weights or data are gone, no character has a mesh, or the model shows nothing.
    """
    file, weights = run.folder / RAY_WEIGHTS_FILE, run.folder / "weights.safetensors"
    if file.is_file() and (not weights.is_file() or file.stat().st_mtime >= weights.stat().st_mtime):
        return read_ray_weights(file)
    model = load(run.folder, trusted_targets=trusted)
    root = data_root(run)
    names = names_of(read_dataset(root), run.metrics["split"])[:CHARACTERS]
    found = ray_weights(model.network, model.renderer, [load_character(root, name) for name in names])
    write_ray_weights(file, found)
    return found


def sharpness(rows: Sequence[Row], folder: Path, *, trusted: Sequence[str] = ()) -> list[Block]:
    """Table and diagrams over the first run of every row; rows that can not be measured are told with the reason."""
    found: dict[str, RayWeights] = {}
    problems: dict[str, list[str]] = {}
    for row in rows:
        try:
            found[row.label] = measure(row.runs[0], trusted=trusted)
        except CharNeRFError as error:
            problems.setdefault(str(error), []).append(row.label)
    told = [f"{', '.join(labels)}: {problem}" for problem, labels in problems.items()]
    left: list[Block] = [Text("Not measured:"), Bullets(told)] if told else []
    if not found:
        return [Heading(TITLE), *left]
    return [Heading(TITLE), _table(found), Text(_told(found)), *_plots(found, folder), *left]


def _table(found: dict[str, RayWeights]) -> Table:
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
        for label, one in found.items()
    ]
    hull = next((one for one in found.values() if one.hull_depth_error_m is not None), None)
    if hull is not None and hull.hull_depth_error_m is not None:
        cells.append([_HULL, NONE, f"{100.0 * hull.hull_depth_error_m:.2f}", NONE, NONE, NONE])
    return Table(header, cells)


def _told(found: dict[str, RayWeights]) -> str:
    names = next(iter(found.values())).characters
    return (
        f"Test characters: {', '.join(names)}. Rays that meet the captured mesh and at which the field is opaque (their share"
        f" stands under opaque); {NUM_SAMPLES} even samples on the part inside the hull, alike for all rows. Entropy of a ray's"
        " weights over the largest possible: 0 if one sample holds all, 1 if all hold the same. Depth is the expected one along"
        " the ray, the truth is the captured mesh's; a negative offset lies in front of it. The hull's depth is that of its first"
        " occupied step, a lower bar: a field that says no more than the silhouettes reaches it."
    )


def _plots(found: dict[str, RayWeights], folder: Path) -> list[Block]:
    shares = {
        "entropy of the weights": {label: [(one.shares, one.entropy_at)] for label, one in found.items()},
        "depth error, m": {label: [(one.shares, one.error_at)] for label, one in found.items()},
    }
    title = f"mean weight in {100.0 * STEP:.0f} cm"
    weights: dict[str, dict[str, list[Line]]] = {
        title: {label: [(one.distances_m, one.weight_at)] for label, one in found.items()}
    }
    return [
        Plot(
            lines_figure(weights, x=_BEHIND),
            Picture(
                plot_lines(weights, folder / "report_ray_weights.png", x=_BEHIND),
                "Where the weight of a ray lies: at 0 is the captured surface",
            ),
        ),
        Plot(
            lines_figure(shares, x=_SHARE),
            Picture(
                plot_lines(shares, folder / "report_depth.png", x=_SHARE),
                "Entropy and depth error that a share of the rays stays below",
            ),
        ),
    ]
