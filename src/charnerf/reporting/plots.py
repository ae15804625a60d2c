"""The reports' diagrams, drawn without a screen, and the curve of a run that they draw."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from charnerf.errors import DataError

_OURS, _HULL, _FOREGROUND, _GREY = "#1f5fa8", "#b8601a", "#3f8f5f", "#8a9099"
_MANY = (_OURS, _HULL, _FOREGROUND, "#7a4fa3", "#b03a5b", "#4d7f91", "#8a7a1f", "#555b63")
_DASHES = ("-", "--", ":", "-.")

Curve = list[dict[str, float]]


def read_curve(path: Path) -> Curve:
    """Rows of a curve.csv as numbers; cells that are empty or no numbers are left out.

    Raises:
        DataError: If the file has no column `seconds`.
    """
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if "seconds" not in (reader.fieldnames or ()):
            columns = ", ".join(reader.fieldnames or ()) or "none"
            raise DataError(
                f"{path}: found the columns {columns}, expected `seconds` among "
                "them; the run's curve.csv is another file or was cut off."
            )
        return [_numbers(row) for row in reader]


def _numbers(row: Mapping[str, Any]) -> dict[str, float]:
    """The cells of a row that are finite numbers."""
    found = {}
    for key, cell in row.items():
        try:
            value = float(cell)
        except (TypeError, ValueError):
            continue
        if value - value == 0.0:
            found[key] = value
    return found


def _save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG in one step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.part")
    FigureCanvasAgg(figure).print_figure(aside, format="png", dpi=110)
    aside.replace(path)
    return path


def _tidy(axes: Axes, *, x: str, y: str) -> None:
    """Labels, a light grid, no box."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="#e6e8eb", linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _points(curve: Curve, key: str) -> tuple[list[float], list[float]]:
    """Seconds and values of a column, where both are there."""
    rows = [row for row in curve if "seconds" in row and key in row]
    return [row["seconds"] for row in rows], [row[key] for row in rows]


def plot_training(curve: Curve, path: Path) -> Path | None:
    """Validation PSNR, whole and foreground, against training seconds; None where the curve has none."""
    lines = [
        (key, label, colour)
        for key, label, colour in (
            ("val_psnr", "whole picture", _OURS),
            ("val_psnr_foreground", "foreground", _FOREGROUND),
        )
        if _points(curve, key)[0]
    ]
    if not lines:
        return None
    figure = Figure(figsize=(7.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for key, label, colour in lines:
        seconds, values = _points(curve, key)
        axes.plot(seconds, values, color=colour, marker="o", markersize=3.5, linewidth=1.8, label=label)
        axes.annotate(
            f"{values[-1]:.1f}", (seconds[-1], values[-1]), xytext=(5, 3), textcoords="offset points"
        )
    _tidy(axes, x="training time, seconds (evaluation excluded)", y="validation PSNR, dB")
    axes.margins(x=0.08)
    axes.legend(frameon=False)
    return _save(figure, path)


def _values(rows: Sequence[Mapping[str, Any]], x: str, key: str) -> tuple[list[float], list[float]]:
    """Abscissae and values of the rows that have a value."""
    chosen = [row for row in rows if row.get(key) is not None]
    return [row[x] for row in chosen], [row[key] for row in chosen]


def plot_angles(metrics: Mapping[str, Any], path: Path) -> Path:
    """PSNR by azimuth and by the angle to the nearest drawing, ours and the visual hull's."""
    figure = Figure(figsize=(11.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    hull = metrics.get("baselines", {}).get("visual_hull", {}).get("by_azimuth", [])
    for rows, who, dash in ((metrics["by_azimuth"], "charnerf", "-"), (hull, "visual hull", "--")):
        for key, what, colour in (("psnr", "whole", _OURS), ("psnr_foreground", "foreground", _FOREGROUND)):
            x, y = _values(rows, "azimuth_deg", key)
            if x:
                left.plot(x, y, dash, color=colour, marker="o", markersize=3.5, label=f"{who}, {what}")
    left.set_xticks(range(0, 360, 30))
    _tidy(left, x="azimuth, degrees (0 front, 90 left side, 180 back)", y="PSNR, dB")
    left.legend(frameon=False, fontsize=8, ncols=2)
    rows = [row for row in metrics.get("by_source_angle", ()) if row.get("psnr") is not None]
    names = [f"{row['source_angle_deg_from']}-{row['source_angle_deg_to']}" for row in rows]
    for key, what, colour in (("psnr", "whole", _OURS), ("psnr_foreground", "foreground", _FOREGROUND)):
        values = [row[key] if row[key] is not None else float("nan") for row in rows]
        right.plot(
            range(len(rows)), values, color=colour, marker="o", markersize=3.5, label=f"charnerf, {what}"
        )
    right.set_xticks(range(len(rows)), names)
    _tidy(right, x="angle to the nearest drawing, degrees", y="PSNR, dB")
    right.legend(frameon=False, fontsize=8)
    return _save(figure, path)


def plot_curves(curves: Mapping[str, Curve], path: Path) -> Path | None:
    """Validation PSNR of many runs against training seconds; None where no run has any."""
    drawn = {name: _points(curve, "val_psnr") for name, curve in curves.items()}
    drawn = {name: points for name, points in drawn.items() if points[0]}
    if not drawn:
        return None
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    for index, (name, (seconds, values)) in enumerate(drawn.items()):
        dash = _DASHES[index // len(_MANY) % len(_DASHES)]
        axes.plot(
            seconds,
            values,
            dash,
            color=_MANY[index % len(_MANY)],
            marker="o",
            markersize=3,
            linewidth=1.6,
            label=name,
        )
    _tidy(axes, x="training time, seconds (evaluation excluded)", y="validation PSNR, dB")
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return _save(figure, path)
