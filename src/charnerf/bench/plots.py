"""Work-precision diagrams: error over seconds, both logarithmic, one curve a method, the Pareto front marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from charnerf.bench.sweeps import Row, pareto
from charnerf.files import write_aside

LEAST_ERROR = 1e-7  # drawn: an empty picture has none


def plot_work_precision(rows: Sequence[Row], path: Path, *, title: str) -> Path:
    """Draw error against the converged reference, and loss against the truth, over seconds.

    Args:
        rows: Points; a curve each name.
        path: PNG to write.
        title: Of the figure.
    """
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_errors(left, rows, annotated=True)
    for name, mine in _curves(rows):
        right.semilogx([row.seconds for row in mine], [row.psnr for row in mine], "o-", ms=4, label=name)
    left.set(xlabel="seconds for the rays", ylabel="rms error of colours against the converged reference")
    right.set(xlabel="seconds for the rays", ylabel="PSNR against the truth, dB")
    right.grid(True, which="both", alpha=0.3)
    left.legend(fontsize=7)
    figure.suptitle(title)
    return _save(figure, path)


def plot_kinds(rows_of: Mapping[str, Sequence[Row]], path: Path) -> Path:
    """Draw error over seconds, one panel each kind of scene."""
    across = 3
    down = -(-len(rows_of) // across)
    figure = Figure(figsize=(11, 3.4 * down), layout="constrained")
    panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False).flatten()
    for panel in panels[len(rows_of) :]:
        panel.set_axis_off()
    for axes, (kind, rows) in zip(panels, rows_of.items(), strict=False):
        _draw_errors(axes, rows, annotated=False)
        axes.set_title(kind, fontsize=9)
    panels[0].legend(fontsize=7)
    figure.supxlabel("seconds for the rays")
    figure.supylabel("rms error of colours against the converged reference")
    return _save(figure, path)


def plot_losses(curves: Mapping[str, Sequence[Sequence[float]]], path: Path) -> Path:
    """Draw the loss over steps, a line each seed, a colour each method."""
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.subplots()
    for index, (name, of_seeds) in enumerate(curves.items()):
        for seed, losses in enumerate(of_seeds):
            axes.semilogy(
                range(1, len(losses) + 1),
                losses,
                color=f"C{index}",
                alpha=0.7,
                lw=1,
                label=name if seed == 0 else None,
            )
    axes.set(xlabel="step", ylabel="loss of the batch (a line each seed of batches)")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7)
    return _save(figure, path)


def _draw_errors(axes: Axes, rows: Sequence[Row], *, annotated: bool) -> None:
    """Error over seconds, a curve each method, and the front."""
    for name, mine in _curves(rows):
        axes.loglog([row.seconds for row in mine], [_error(row) for row in mine], "o-", ms=4, label=name)
    front = pareto(rows)
    axes.loglog(
        [row.seconds for row in front],
        [_error(row) for row in front],
        "ks",
        mfc="none",
        ms=9,
        label="Pareto front",
    )
    for row in front if annotated else ():
        axes.annotate(row.setting, (row.seconds, _error(row)), fontsize=6, xytext=(4, 4),
                      textcoords="offset points")  # fmt: skip
    axes.grid(True, which="both", alpha=0.3)


def _curves(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """Rows of each method, fastest first."""
    names = dict.fromkeys(row.curve for row in rows)
    return [(name, sorted((r for r in rows if r.curve == name), key=lambda r: r.seconds)) for name in names]


def _error(row: Row) -> float:
    return max(row.rms_error, LEAST_ERROR)


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
    """Write a figure as PNG, whole or not at all."""
    with write_aside(path) as aside:
        FigureCanvasAgg(figure).print_figure(aside, format="png", dpi=110)
    return path
