"""One report over all runs below a folder: tables, diagrams, pictures, and which differences hold."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.errors import DataError
from charnerf.reporting.attention import attention, with_view_attention
from charnerf.reporting.blocks import Block, Heading, Text
from charnerf.reporting.by_angle import by_angle
from charnerf.reporting.characters import characters
from charnerf.reporting.comparison import (
    best_row,
    comparison,
    costs,
    families,
    left_out_rows,
    shown_rows,
    sorted_rows,
    unfinished,
)
from charnerf.reporting.drawn import drawn_matrix
from charnerf.reporting.levels import levels
from charnerf.reporting.matrix import matrix
from charnerf.reporting.parts import verdict, write_report
from charnerf.reporting.ray_weights import sharpness
from charnerf.reporting.rows import Row, Run, common_overrides, group_rows, read_runs, read_unfinished
from charnerf.reporting.trends import trends
from charnerf.reporting.verdicts import significance

ATTENTION_ROWS = 4  # figures of view attention in one report, at most


def write_folder_report(
    folder: str | Path, *, drawings: Path | None = None, trusted: Sequence[str] = ()
) -> Path:
    """Write report.md and report.html over all runs below a folder.

    Args:
        folder: Any folder; every metrics.json below it is a run. Runs that differ in their seed alone are one row.
        drawings: A folder of drawings to show through every row.
        trusted: Modules of the user's own classes that the runs' configs may name.

    Returns:
        The Markdown file.

    Raises:
        DataError: If there is no run below it, one of its files is unreadable, or there are no drawings where some are
            asked for.
    """
    folder = Path(folder)
    runs = read_runs(folder)
    if not runs:
        raise DataError(
            f"{folder}: found no metrics.json below it, expected finished runs; train or evaluate first."
        )
    rows = sorted_rows(group_rows(runs))
    title = f"charnerf: {len(rows)} rows, {len(runs)} runs in {folder.resolve().name}"
    blocks: list[Block] = [Heading(title, 1), Text(_lead(rows, runs), lead=True)]
    blocks += unfinished(read_unfinished(folder))
    blocks += comparison(rows)
    blocks += costs(rows)
    blocks += significance(rows)
    blocks += trends(rows, folder)
    for number, family in enumerate(families(rows)):
        shown = shown_rows(family.rows)
        told = left_out_rows(family.rows, shown)
        title, suffix = f": {family.variant}" if family.variant else "", f"_{number}" if number else ""
        blocks += [*by_angle(shown, folder, title=title, suffix=suffix), *told]
        blocks += [*matrix(shown, folder, title=title, suffix=suffix), *told]
        if drawings is not None:
            blocks += drawn_matrix(shown, drawings, folder, trusted=trusted, title=title, suffix=suffix)
            blocks += told
    blocks += sharpness(rows, folder, trusted=trusted)
    blocks += attention(shown_rows(with_view_attention(rows), ATTENTION_ROWS), folder, trusted=trusted)
    blocks += levels(rows)
    blocks += characters(rows)
    return write_report(folder, title, blocks)


def _lead(rows: Sequence[Row], runs: Sequence[Run]) -> str:
    """Which row is best, and what all of them share."""
    best = best_row(rows)
    shared = common_overrides(runs)
    told = f" All runs: {' '.join(shared)}." if shared else ""
    measured = {
        (run.metrics["split"], run.metrics["num_characters"], run.metrics["num_views"]) for run in runs
    }
    mixed = (
        " The runs were not measured on the same views: their figures do not compare."
        if len(measured) > 1
        else ""
    )
    return f"Best on the foreground: {best.label}. {verdict(best.runs[0].metrics)}{told}{mixed}"
