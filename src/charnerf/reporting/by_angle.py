"""Distributions over views, by azimuth and by the angle to the nearest drawing, one box a row."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from charnerf.evaluation.angles import AZIMUTH_STEP_DEG, SOURCE_EDGES_DEG, azimuth_bin, edge_bin
from charnerf.evaluation.character import OURS
from charnerf.reporting.blocks import Block, Heading, Picture, Plot, Text
from charnerf.reporting.interactive import boxes_figure
from charnerf.reporting.plots import plot_boxes
from charnerf.reporting.rows import Row
from charnerf.reporting.run_files import View
from charnerf.reporting.runs import Run

METRICS = {"psnr": "PSNR, dB", "psnr_foreground": "foreground PSNR, dB", "ssim": "SSIM"}
AZIMUTHS = [f"{start}°" for start in range(0, 360, AZIMUTH_STEP_DEG)]
DISTANCES = [f"{low}-{high}°" for low, high in pairwise(SOURCE_EDGES_DEG)]
HULL = "visual_hull"
NO_VIEWS = "These runs kept no figures of single views (views.csv); evaluate them again with this version."
Boxes = dict[str, dict[str, list[float]]]


def azimuth_name(view: View) -> str:
    """Bin of 30 degrees, by its centre."""
    return AZIMUTHS[azimuth_bin(view.numbers["azimuth_deg"])]


def distance_name(view: View) -> str:
    """Bin of 15 degrees of the angle to the nearest drawing."""
    return DISTANCES[edge_bin(view.numbers["source_angle_deg"], SOURCE_EDGES_DEG)]


def views_by_row(rows: Sequence[Row]) -> dict[str, list[View]]:
    """Views of every row over its seeds, and the visual hull's of the first run that has them."""
    by_row = {row.label: [view for run in row.runs for view in _views_of(run, OURS)] for row in rows}
    hulls = [_views_of(run, HULL) for row in rows for run in row.runs]
    by_row["visual hull"] = next((views for views in hulls if views), [])
    return {label: views for label, views in by_row.items() if views}


def _views_of(run: Run, method: str) -> list[View]:
    return [view for view in run.views or () if view.method == method]


def by_angle(rows: Sequence[Row], folder: Path, *, title: str = "", suffix: str = "") -> list[Block]:
    """Both diagrams, or why there are none; the suffix is that of the pictures' names."""
    views = views_by_row(rows)
    blocks: list[Block] = [Heading(f"By viewing angle{title}")]
    if not views:
        return [*blocks, Text(NO_VIEWS)]
    missing = [row.label for row in rows if row.label not in views]
    if missing:
        blocks.append(Text(f"Without figures of single views (views.csv): {', '.join(missing)}."))
    azimuth = "azimuth (0 front, 90 left side, 180 back)"
    distance = "angle to the nearest drawing"
    boxes = _boxes(views, AZIMUTHS, azimuth_name)
    blocks.append(_plot(boxes, AZIMUTHS, folder / f"report_azimuth{suffix}.png", azimuth, "azimuth"))
    filled = {distance_name(view) for each in views.values() for view in each}
    bins = [name for name in DISTANCES if name in filled]
    boxes = _boxes(views, bins, distance_name)
    blocks.append(_plot(boxes, bins, folder / f"report_distance{suffix}.png", distance, distance))
    return blocks


def _boxes(
    views: Mapping[str, Sequence[View]], bins: Sequence[str], name_of: Callable[[View], str]
) -> dict[str, Boxes]:
    """Values by metric, then by row, then by bin."""
    boxes: dict[str, Boxes] = {}
    for key, title in METRICS.items():
        rows: Boxes = {label: {name: [] for name in bins} for label in views}
        for label, each in views.items():
            for view in each:
                if key in view.numbers:
                    rows[label][name_of(view)].append(view.numbers[key])
        boxes[title] = rows
    return boxes


def _plot(boxes: dict[str, Boxes], bins: list[str], path: Path, x: str, what: str) -> Plot:
    """Interactive over all metrics, still over the first."""
    title, rows = next(iter(boxes.items()))
    picture = plot_boxes(rows, path, x=x, y=title, bins=bins)
    caption = f"PSNR of every view by {what}: median, quartiles, 1.5 interquartile ranges, views beyond"
    return Plot(boxes_figure(boxes, x=x, bins=bins), Picture(picture, caption))
