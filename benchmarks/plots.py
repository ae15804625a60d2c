"""Diagrams of kinds of scene, of losses and of growth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from charnerf.bench.plots import draw_errors, save_figure
from charnerf.bench.sweep import Row


def plot_kinds(rows_of: Mapping[str, Sequence[Row]], path: Path) -> Path:
    """Draw error over seconds, one panel each kind of scene."""
    across = 3
    down = -(-len(rows_of) // across)
    figure = Figure(figsize=(11, 3.4 * down), layout="constrained")
    panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False).flatten()
    for panel in panels[len(rows_of) :]:
        panel.set_axis_off()
    for axes, (kind, rows) in zip(panels, rows_of.items(), strict=False):
        draw_errors(axes, rows, annotated=False)
        axes.set_title(kind, fontsize=9)
    panels[0].legend(fontsize=7)
    figure.supxlabel("seconds for the rays")
    figure.supylabel("rms error of colours against the converged reference")
    return save_figure(figure, path)


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
    return save_figure(figure, path)


def plot_growth(growths: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw seconds over size for everything that grows, with its exponent."""
    figure = Figure(figsize=(7, 4.6), layout="constrained")
    axes = figure.subplots()
    for one in growths:
        axes.loglog(one["sizes"], one["seconds"], "o-", label=f"{one['over']}: {one['seconds_exponent']:.2f}")
    axes.set(xlabel="size", ylabel="seconds")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7, title="exponent")
    return save_figure(figure, path)
