"""What `charnerf report` writes: the report of a run, or one over all runs below a folder."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.reporting.attention import attention
from charnerf.reporting.blocks import Block
from charnerf.reporting.drawn import drawn_matrix
from charnerf.reporting.folder_report import write_folder_report
from charnerf.reporting.levels import levels
from charnerf.reporting.ray_weights import sharpness
from charnerf.reporting.rows import group_rows, read_runs
from charnerf.reporting.run_report import write_run_report


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
        more += drawn_matrix(rows, drawings, folder, trusted=trusted)
    return write_run_report(folder, more=[*more, *levels(rows)])
