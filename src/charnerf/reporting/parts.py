"""What the reports of one run and of many share: reading metrics.json, cells, columns, writing both forms."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from charnerf.errors import DataError
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.files import write_text
from charnerf.reporting.blocks import Block, Picture, Plot, Table, Text, plot_library, to_html, to_markdown

COLUMNS = {
    "psnr": ("PSNR ↑ dB", "{:.2f}"),
    "psnr_foreground": ("foreground ↑ dB", "{:.2f}"),
    "ssim": ("SSIM ↑", "{:.3f}"),
    "lpips": ("LPIPS ↓", "{:.3f}"),
    "flip": ("FLIP ↓", "{:.3f}"),
    "silhouette_iou": ("IoU ↑", "{:.3f}"),
    "chamfer_mm": ("Chamfer ↓ mm", "{:.1f}"),
    "f_score": ("F-score 2 cm ↑", "{:.3f}"),
}
BASELINE_NAMES = {
    "visual_hull": "visual hull (carved, coloured)",
    "nearest": "nearest training character (coloured)",
    "white": "white picture",
}
MAX_SHEETS = 12
_NEEDED = (*METRIC_KEYS, "split", "num_characters", "num_views", "by_azimuth", "per_character", "seconds")
NONE = "-"
STILL = (
    "The diagrams of report.html are still pictures, because plotly is not installed. For ones to point at and zoom: "
    "pip install 'charnerf[report]' (in a clone: pip install -e '.[report]'), then `charnerf report` again."
)


def read_metrics(path: Path) -> dict[str, Any]:
    """Content of a metrics.json.

    Raises:
        DataError: If it is missing, no JSON, or lacks the metrics.
    """
    try:
        metrics = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise DataError(
            f"{path}: no such file, expected a finished evaluation; run `charnerf evaluate`."
        ) from error
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: is not readable JSON ({error}); run `charnerf evaluate` again.") from error
    missing = [key for key in _NEEDED if not isinstance(metrics, dict) or key not in metrics]
    if missing:
        raise DataError(f"{path}: lacks {', '.join(missing)}; run `charnerf evaluate` again.")
    return dict(metrics)


def cell(value: float | None, form: str) -> str:
    """A number for a table; a dash where there is none."""
    return NONE if value is None else form.format(value)


def seconds_text(value: float | None) -> str:
    """Seconds with three figures, minutes and hours where they read better."""
    if value is None:
        return NONE
    if value < 120.0:
        return f"{value:.3g} s"
    return f"{value / 60.0:.1f} min" if value < 7200.0 else f"{value / 3600.0:.1f} h"


def metric_cells(metrics: Mapping[str, Any]) -> list[str]:
    """The metrics of COLUMNS as cells."""
    return [cell(metrics.get(key), form) for key, (_, form) in COLUMNS.items()]


def verdict(metrics: Mapping[str, Any]) -> str:
    """What the run reached, and by how much it beats the better baseline."""
    start = (
        f"{metrics['num_characters']} characters of the {metrics['split']} split, "
        f"{metrics['num_views']} views: "
        f"{cell(metrics['psnr'], '{:.2f}')} dB PSNR, "
        f"{cell(metrics['psnr_foreground'], '{:.2f}')} dB on the foreground"
    )
    gains = []
    for key, unit, form in (
        ("psnr", "dB PSNR", "{:+.2f}"),
        ("psnr_foreground", "dB foreground", "{:+.2f}"),
        ("ssim", "SSIM", "{:+.3f}"),
    ):
        others = [found[key] for found in metrics.get("baselines", {}).values() if found.get(key) is not None]
        if others and metrics[key] is not None:
            gains.append(f"{form.format(metrics[key] - max(others))} {unit}")
    return start + (f"; against the better baseline {', '.join(gains)}." if gains else ".")


def character_table(metrics: Mapping[str, Any]) -> tuple[list[str], Table]:
    """Names worst first, and their table."""
    found = metrics["per_character"]
    worst_first = sorted(
        found, key=lambda name: (found[name]["psnr_foreground"] or 0.0, found[name]["psnr"] or 0.0)
    )
    header = ["character", *(title for title, _ in COLUMNS.values())]
    return worst_first, Table(header, [[name, *metric_cells(found[name])] for name in worst_first])


def sheets_of(folder: Path, worst_first: Sequence[str], metrics: Mapping[str, Any]) -> dict[str, Picture]:
    """Contact sheets that are there, worst first."""
    found = {}
    for name in worst_first:
        path = folder / "images" / name / "sheet.png"
        if path.is_file():
            scores = metrics["per_character"][name]
            caption = (
                f"{name}: {cell(scores['psnr'], '{:.1f}')} dB, "
                f"foreground {cell(scores['psnr_foreground'], '{:.1f}')} dB, "
                f"IoU {cell(scores['silhouette_iou'], '{:.2f}')}"
            )
            found[name] = Picture(path, caption)
    return found


def write_report(folder: Path, title: str, blocks: Sequence[Block]) -> Path:
    """Write both forms, each in one step; plots stay still where plotly is not installed, which the report says."""
    if any(isinstance(block, Plot) for block in blocks) and plot_library() is None:
        blocks = [*blocks, Text(STILL)]
    write_text(folder / "report.html", to_html(title, blocks))
    write_text(folder / "report.md", to_markdown(blocks, folder))
    return folder / "report.md"
