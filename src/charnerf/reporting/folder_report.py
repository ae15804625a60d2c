"""What `charnerf report` writes: the report of a run, or one over all runs below a folder."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.errors import DataError
from charnerf.reporting.attention import attention, with_view_attention
from charnerf.reporting.blocks import Block, Heading, Text
from charnerf.reporting.by_angle import by_angle
from charnerf.reporting.characters import characters
from charnerf.reporting.comparison import comparison, costs, unfinished
from charnerf.reporting.document import write_report
from charnerf.reporting.families import best_row, families, left_out_rows, shown_rows, sorted_rows
from charnerf.reporting.lods import lods
from charnerf.reporting.meshes import row_meshes
from charnerf.reporting.picture_matrix import picture_matrix
from charnerf.reporting.ray_weights import sharpness
from charnerf.reporting.real_drawings import real_drawings
from charnerf.reporting.rows import Row, common_overrides, group_rows
from charnerf.reporting.run_report import verdict, write_run_report
from charnerf.reporting.runs import Run, read_runs, read_unfinished
from charnerf.reporting.significance import significance
from charnerf.reporting.training_time import training_time
from charnerf.wording import counted

ATTENTION_ROWS = 4  # figures of view attention in one report, at most


def report(folder: Path, *, drawings: Path | None = None, trusted: Sequence[str] = ()) -> Path:
    """Write report.md and report.html of a folder.

    Args:
        folder: A run, whose own report gains the attention figure and the drawings; or any folder above runs.
        drawings: A folder of drawings to show through every row.
        trusted: Modules of the user's own classes that the runs' configs may name.

    Returns:
        The Markdown file.

    Raises:
        DataError: If there is no run, a file is unreadable, or there are no drawings where some are asked for.
    """
    runs = read_runs(folder)
    if [run.folder for run in runs] != [folder]:
        return write_folder_report(folder, drawings=drawings, trusted=trusted)
    rows = group_rows(runs)
    more: list[Block] = [*sharpness(rows, folder, trusted=trusted), *attention(rows, folder, trusted=trusted)]
    if drawings is not None:
        more += real_drawings(rows, drawings, folder, trusted=trusted)
    return write_run_report(folder, more=[*more, *lods(rows)])


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
        raise DataError(_nothing_finished(folder))
    rows = sorted_rows(group_rows(runs))
    title = f"charnerf: {counted(len(rows), 'row')}, {counted(len(runs), 'run')} in {folder.resolve().name}"
    blocks: list[Block] = [Heading(title, 1), Text(_lead(rows, runs), lead=True)]
    blocks += unfinished(read_unfinished(folder))
    blocks += comparison(rows)
    blocks += costs(rows)
    blocks += significance(rows)
    blocks += training_time(rows, folder)
    for number, family in enumerate(families(rows)):
        shown = shown_rows(family.rows)
        note = left_out_rows(family.rows, shown)
        names = {
            "title": f": {family.variant}" if family.variant else "",
            "suffix": f"_{number}" if number else "",
        }
        blocks += [*by_angle(shown, folder, **names), *note]
        blocks += [*picture_matrix(shown, folder, **names), *note]
        if drawings is not None:
            blocks += [*real_drawings(shown, drawings, folder, trusted=trusted, **names), *note]
    blocks += row_meshes(rows)
    blocks += sharpness(rows, folder, trusted=trusted)
    blocks += attention(shown_rows(with_view_attention(rows), ATTENTION_ROWS), folder, trusted=trusted)
    blocks += lods(rows)
    blocks += characters(rows)
    return write_report(folder, title, blocks)


def _nothing_finished(folder: Path) -> str:
    """What there is instead of finished runs."""
    begun = [
        f"\n  {one.name}: {one.state}{f', {one.error}' if one.error else ''}"
        for one in read_unfinished(folder)
    ]
    advice = "the same command goes on with what was begun:" if begun else "train or evaluate first."
    return f"{folder}: found no metrics.json below it, expected finished runs; {advice}{''.join(begun)}"


def _lead(rows: Sequence[Row], runs: Sequence[Run]) -> str:
    """Which row is best, and what all of them share."""
    best = best_row(rows)
    common = common_overrides(runs)
    overrides = f" All runs: {' '.join(common)}." if common else ""
    measured = {
        (run.metrics["split"], run.metrics["num_characters"], run.metrics["num_views"]) for run in runs
    }
    mixed = (
        " The runs were not measured on the same views: their figures do not compare."
        if len(measured) > 1
        else ""
    )
    return f"Best on the foreground: {best.label}. {verdict(best.runs[0].metrics)}{overrides}{mixed}"
