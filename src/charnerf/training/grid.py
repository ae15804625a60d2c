"""The end of a grid: its report, and what is not done."""

import logging
from pathlib import Path

from charnerf.errors import GridError
from charnerf.reporting.folder_report import write_folder_report
from charnerf.training.cells import DONE, cells_of
from charnerf.wording import counted

log = logging.getLogger(__name__)
BEGUN_FILE = ".begun"
LOST_WORKERS = ("TerminatedWorkerError", "BrokenProcessPool")  # joblib's, by name: it is an extra


def begin_grid(grid: Path) -> float:
    """Note that a sweep begins; the file system's time of it."""
    grid.mkdir(parents=True, exist_ok=True)
    (grid / BEGUN_FILE).touch()
    return (grid / BEGUN_FILE).stat().st_mtime


def is_lost_worker(error: BaseException) -> bool:
    """Whether a launcher says that one of its processes was killed."""
    return type(error).__name__ in LOST_WORKERS


def report_grid(grid: Path) -> Path | None:
    """Write the report over the finished cells of a grid; None where there is none."""
    if not any(grid.rglob("metrics.json")):
        return None
    report = write_folder_report(grid)
    log.info("Report over the grid: %s", report)
    return report


def check_grid(grid: Path, *, since: float = 0.0) -> None:
    """Say which cells of a grid are not done.

    Args:
        grid: Folder of all cells.
        since: When the sweep began whose cells count; all cells count by default.

    Raises:
        GridError: Names each one with its state and error.
    """
    cells = cells_of(grid, since=since)
    left = [cell for cell in cells if cell.state != DONE]
    if not left:
        return
    lines = [f"  {cell.name}: {cell.state}{f', {cell.error}' if cell.error else ''}" for cell in left]
    raise GridError(
        "\n".join(
            [
                f"{grid}: {len(left)} of {counted(len(cells), 'cell')} not done, expected all of them; the same command"
                " goes on with them, error.txt in a cell's folder says more:",
                *lines,
            ]
        )
    )
