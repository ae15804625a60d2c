"""Work-precision diagrams: error over seconds, both logarithmic, one curve a method, the Pareto front marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from charnerf.bench.sweeps import Row, pareto


def plot_work_precision(rows: Sequence[Row], path: Path, *, title: str) -> Path:
    """Draw error against the converged reference, and loss against the truth, over seconds.

    Args:
        rows: Points; a curve each name.
        path: PNG to write.
        title: Of the figure.
    """
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name in dict.fromkeys(row.curve for row in rows):
        mine = sorted((row for row in rows if row.curve == name), key=lambda row: row.seconds)
        seconds = [row.seconds for row in mine]
        left.loglog(seconds, [max(row.rms_error, 1e-7) for row in mine], "o-", ms=4, label=name)
        right.semilogx(seconds, [row.psnr for row in mine], "o-", ms=4, label=name)
    front = pareto(rows)
    left.loglog(
        [row.seconds for row in front],
        [max(row.rms_error, 1e-7) for row in front],
        "ks",
        mfc="none",
        ms=9,
        label="Pareto front",
    )
    for row in front:
        left.annotate(row.setting, (row.seconds, max(row.rms_error, 1e-7)), fontsize=6, xytext=(4, 4),
                      textcoords="offset points")  # fmt: skip
    left.set(xlabel="seconds for the rays", ylabel="rms error of colours against the converged reference")
    right.set(xlabel="seconds for the rays", ylabel="PSNR against the truth, dB")
    left.grid(True, which="both", alpha=0.3)
    right.grid(True, which="both", alpha=0.3)
    left.legend(fontsize=7)
    figure.suptitle(title)
    return _save(figure, path)


def plot_kinds(comparisons: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw largest error over seconds by kind of scene, a marker each method."""
    figure = Figure(figsize=(7, 4.6), layout="constrained")
    axes = figure.subplots()
    markers = {"pixelNeRF-like": "s", "culled": "o", "adaptive": "^"}
    for index, one in enumerate(comparisons):
        for name, found in one["methods"].items():
            axes.loglog(
                found["seconds"],
                max(found["max_error"], 1e-7),
                markers.get(name, "x"),
                color=f"C{index}",
                label=f"{one['kind']}" if name == "culled" else None,
            )
    axes.set(xlabel="seconds for the rays (square: pixelNeRF-like, circle: culled, triangle: adaptive)")
    axes.set(ylabel="largest error of a colour")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7)
    return _save(figure, path)


def plot_growth(growths: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw seconds over size for everything that grows, with its exponent."""
    figure = Figure(figsize=(7, 4.6), layout="constrained")
    axes = figure.subplots()
    for one in growths:
        axes.loglog(one["sizes"], one["seconds"], "o-", label=f"{one['over']}: {one['seconds_exponent']:.2f}")
    axes.set(xlabel="size", ylabel="seconds")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7, title="exponent")
    return _save(figure, path)


def _save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG, beside and then renamed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.part")
    FigureCanvasAgg(figure).print_figure(aside, format="png", dpi=110)
    aside.replace(path)
    return path
