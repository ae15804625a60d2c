"""The reports' still diagrams, drawn without a screen."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from charnerf.files import write_aside
from charnerf.reporting.run_files import Curve, curve_points

PALETTE = ("#1f5fa8", "#b8601a", "#3f8f5f", "#7a4fa3", "#b03a5b", "#4d7f91", "#8a7a1f", "#555b63")
GRID = "#e6e8eb"
_WHOLE, _FOREGROUND = PALETTE[0], PALETTE[2]
_DASHES = ("-", "--", ":", "-.")

Line = tuple[Sequence[float], Sequence[float]]
"""Abscissae and values of one line."""


def _save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG, whole or not at all."""
    with write_aside(path) as aside:
        FigureCanvasAgg(figure).print_figure(aside, format="png", dpi=110)
    return path


def _tidy(axes: Axes, *, x: str, y: str) -> None:
    """Labels, a light grid, no box."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def plot_training(curve: Curve, path: Path) -> Path | None:
    """Validation PSNR, whole and foreground, against training seconds; None where the curve has none."""
    lines = [
        (key, label, color)
        for key, label, color in (
            ("val_psnr", "whole picture", _WHOLE),
            ("val_psnr_foreground", "foreground", _FOREGROUND),
        )
        if curve_points(curve, key)[0]
    ]
    if not lines:
        return None
    figure = Figure(figsize=(7.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for key, label, color in lines:
        seconds, values = curve_points(curve, key)
        axes.plot(seconds, values, color=color, marker="o", markersize=3.5, linewidth=1.8, label=label)
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
        for key, what, color in (("psnr", "whole", _WHOLE), ("psnr_foreground", "foreground", _FOREGROUND)):
            x, y = _values(rows, "azimuth_deg", key)
            if x:
                left.plot(x, y, dash, color=color, marker="o", markersize=3.5, label=f"{who}, {what}")
    left.set_xticks(range(0, 360, 30))
    _tidy(left, x="azimuth, degrees (0 front, 90 left side, 180 back)", y="PSNR, dB")
    left.legend(frameon=False, fontsize=8, ncols=2)
    rows = [row for row in metrics.get("by_source_angle", ()) if row.get("psnr") is not None]
    names = [f"{row['source_angle_deg_from']}-{row['source_angle_deg_to']}" for row in rows]
    for key, what, color in (("psnr", "whole", _WHOLE), ("psnr_foreground", "foreground", _FOREGROUND)):
        values = [row[key] if row[key] is not None else float("nan") for row in rows]
        right.plot(
            range(len(rows)), values, color=color, marker="o", markersize=3.5, label=f"charnerf, {what}"
        )
    right.set_xticks(range(len(rows)), names)
    _tidy(right, x="angle to the nearest drawing, degrees", y="PSNR, dB")
    right.legend(frameon=False, fontsize=8)
    return _save(figure, path)


def plot_lines(panels: Mapping[str, Mapping[str, Sequence[Line]]], path: Path, *, x: str) -> Path:
    """Panels side by side with one legend: by title of the vertical axis, then by row, its lines."""
    figure = Figure(figsize=(4.6 * len(panels) + 1.0, 4.6), layout="constrained")
    every = figure.subplots(1, len(panels), squeeze=False)[0]
    order = list(dict.fromkeys(row for rows in panels.values() for row in rows))
    for axes, (title, rows) in zip(every, panels.items(), strict=True):
        for row, lines in rows.items():
            index = order.index(row)
            look = {
                "color": PALETTE[index % len(PALETTE)],
                "linestyle": _DASHES[index // len(PALETTE) % len(_DASHES)],
            }
            for number, (xs, ys) in enumerate(lines):
                axes.plot(xs, ys, **look, marker="o", markersize=2.5, label=row if number == 0 else None)
        _tidy(axes, x=x, y=title)
    shown = {
        label: line for axes in every for line, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        list(shown.values()), list(shown), frameon=False, fontsize=8, loc="outside lower center", ncols=5
    )
    return _save(figure, path)


def plot_boxes(
    rows: Mapping[str, Mapping[str, Sequence[float]]], path: Path, *, x: str, y: str, bins: Sequence[str]
) -> Path:
    """Box plots side by side in every bin: by row, then by bin, the values."""
    figure = Figure(figsize=(12.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    width = 0.8 / max(len(rows), 1)
    for index, (row, by_bin) in enumerate(rows.items()):
        places = [place for place, name in enumerate(bins) if by_bin.get(name)]
        if not places:
            continue
        look = {"color": PALETTE[index % len(PALETTE)]}
        drawn = axes.boxplot(
            [list(by_bin[bins[place]]) for place in places],
            positions=[place - 0.4 + width * (index + 0.5) for place in places],
            widths=0.85 * width,
            manage_ticks=False,
            patch_artist=True,
            boxprops={"facecolor": look["color"], "alpha": 0.45},
            medianprops=look,
            whiskerprops=look,
            capprops=look,
            flierprops={"marker": ".", "markersize": 3, "markeredgecolor": look["color"]},
        )
        drawn["boxes"][0].set_label(row)
    axes.set_xticks(range(len(bins)), bins)
    _tidy(axes, x=x, y=y)
    figure.legend(frameon=False, fontsize=8, loc="outside lower center", ncols=4)
    return _save(figure, path)
