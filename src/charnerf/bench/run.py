"""What `charnerf bench` measures, and its tables."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from charnerf.bench.headline import headline
from charnerf.bench.levels import characters_of, drawn_levels
from charnerf.bench.plots import plot_work_precision
from charnerf.bench.subjects import NUM_CHARACTERS, NUM_PIXELS, Subject, embedded, of_dataset, prepared
from charnerf.bench.sweep import sample_methods, sweep
from charnerf.bench.tables import comparison_table, headline_table, rows_table
from charnerf.bench.workbench import CULLED, Workbench, workbench
from charnerf.evaluation.environment import environment
from charnerf.inference.model import Model
from charnerf.wording import counted

SAMPLES_PICTURE = "samples.png"


def run(
    model: Model,
    *,
    data: Path | None = None,
    split: str = "test",
    quick: bool = False,
    output: Path | None = None,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """Measure a model on four characters.

    Args:
        model: The trained model.
        data: Data set of the characters; embedded ones if None.
        split: Of the data set.
        quick: Leave out the sweep of samples and tolerances, and the levels of drawings.
        output: Folder that gets the sweep's diagram; none is drawn if None.
        say: Gets a line at every stage, with seconds.

    Returns:
        The headline and what it summarises, "samples" (rows of the sweep), "levels" (rows by how far drawings
        disagree), environment, weights, data.
    """
    start = time.perf_counter()

    def announce(text: str) -> None:
        say(f"{time.perf_counter() - start:6.1f} s  {text}")

    bench = workbench(model)
    announce("converged references of the characters")
    pictured = (
        embedded(NUM_CHARACTERS, bench.image_size)
        if data is None
        else of_dataset(data, split, NUM_CHARACTERS)
    )
    subjects = prepared(bench.network, pictured)
    announce("rendering and training steps")
    result = headline(bench, subjects)
    if not quick:
        announce("samples a ray, tolerances, levels of drawings that disagree")
        result["samples"] = _sweep_samples(bench, subjects, output)
        result["levels"] = _levels(bench, data, split)
    announce("done")
    return {
        **result,
        "environment": environment(model.device),
        "weights": model.source.name,
        "data": "embedded" if data is None else f"{data.name}, split {split}",
        "seconds": time.perf_counter() - start,
    }


def _sweep_samples(
    bench: Workbench, subjects: Sequence[Subject], output: Path | None
) -> list[dict[str, Any]]:
    """Rows of the sweep of samples and tolerances, and its diagram in a folder."""
    rows = sweep(sample_methods(bench), subjects, repeats=3)
    if output is not None:
        title = f"{NUM_PIXELS} pixels of each of {counted(len(subjects), 'character')}"
        plot_work_precision(rows, output / SAMPLES_PICTURE, title=title)
    return [vars(row) for row in rows]


def _levels(bench: Workbench, data: Path | None, split: str) -> list[dict[str, Any]]:
    """Rows of the levels of drawings, by the renderer that pictures are made with by default."""
    with tempfile.TemporaryDirectory() as folder:
        characters = characters_of(data, split, NUM_CHARACTERS, folder=Path(folder), size=bench.image_size)
        return drawn_levels(bench.network, bench.renderers[CULLED], characters)


def summary(result: dict[str, Any]) -> str:
    """The main tables of a run as text."""
    machine = result["environment"]
    tables = [headline_table(result["headline"]), comparison_table(result["characters"])]
    if "samples" in result:
        tables += [rows_table(result["samples"]), rows_table(result["levels"])]
    where = f"{machine['machine']}, {counted(machine['threads'], 'thread')}, torch {machine['torch']}, {machine['device']}"
    return "\n\n".join([*tables, where])
