"""Work-precision diagrams: error over seconds, both logarithmic, one curve a method, the Pareto front marked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from charnerf.bench.sweep import Row, pareto
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
    draw_errors(left, rows, annotated=True)
    for name, mine in _curves(rows):
        right.semilogx([row.seconds for row in mine], [row.psnr for row in mine], "o-", ms=4, label=name)
    left.set(xlabel="seconds for the rays", ylabel="rms error of colours against the converged reference")
    right.set(xlabel="seconds for the rays", ylabel="PSNR against the truth, dB")
    right.grid(True, which="both", alpha=0.3)
    left.legend(fontsize=7)
    figure.suptitle(title)
    return save_figure(figure, path)


def draw_errors(axes: Axes, rows: Sequence[Row], *, annotated: bool) -> None:
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


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG, whole or not at all."""
    with write_aside(path) as aside:
        FigureCanvasAgg(figure).print_figure(aside, format="png", dpi=110)
    return path
