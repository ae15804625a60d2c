"""How figures are written in tables: columns of metrics, numbers, seconds."""

from collections.abc import Mapping
from typing import Any

COLUMNS = {
    "psnr": ("PSNR ↑ dB", "{:.2f}"),
    "psnr_foreground": ("foreground ↑ dB", "{:.2f}"),
    "psnr_union": ("union ↑ dB", "{:.2f}"),
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
NONE = "-"


def cell(value: float | None, form: str) -> str:
    """A number for a table; a dash where there is none."""
    return NONE if value is None else form.format(value)


def metric_cells(metrics: Mapping[str, Any]) -> list[str]:
    """The metrics of COLUMNS as cells."""
    return [cell(metrics.get(key), form) for key, (_, form) in COLUMNS.items()]


def seconds_text(value: float | None) -> str:
    """Seconds with three figures, minutes and hours where they read better."""
    if value is None:
        return NONE
    if value < 120.0:
        return f"{value:.3g} s"
    return f"{value / 60.0:.1f} min" if value < 7200.0 else f"{value / 3600.0:.1f} h"
