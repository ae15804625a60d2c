"""The end of a grid: its report, and what is not done."""

import logging
from pathlib import Path

from charnerf.errors import GridError
from charnerf.reporting.folder_report import write_folder_report
from charnerf.training.cells import DONE, cells_of

log = logging.getLogger(__name__)


def report_grid(grid: Path) -> Path | None:
    """Write the report over the finished cells of a grid; None where there is none."""
    if not any(grid.rglob("metrics.json")):
        return None
    report = write_folder_report(grid)
    log.info("Report over the grid: %s", report)
    return report


def check_grid(grid: Path) -> None:
    """Say which cells of a grid are not done.

    Raises:
        GridError: Names each one with its state and error.
    """
    cells = cells_of(grid)
    left = [cell for cell in cells if cell.state != DONE]
    if not left:
        return
    lines = [f"  {cell.name}: {cell.state}{f', {cell.error}' if cell.error else ''}" for cell in left]
    raise GridError(
        "\n".join(
            [
                f"{grid}: {len(left)} of {len(cells)} cells are not done, expected all of them; the same command"
                " goes on with them, error.txt in a cell's folder says more:",
                *lines,
            ]
        )
    )
