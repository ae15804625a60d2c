"""Cells of a grid: one folder a config, skipped when finished, resumed when killed, recorded when failed.

A cell's folder is a run folder with two files more: `cell.json` tells how far it came, `error.txt` why it failed.
"""

import json
import logging
import os
import shutil
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from omegaconf import DictConfig

from charnerf.config.grid import config_hash
from charnerf.errors import DataError
from charnerf.files import check_folder, is_locked, read_text, write_text
from charnerf.reporting.runs import CELL_FILE, LOCK_FILE
from charnerf.training.checkpoint import has_checkpoint
from charnerf.training.run import run_training

log = logging.getLogger(__name__)
ERROR_FILE, LOG_FILE = "error.txt", "train.log"
REQUEST_FILE = ".requested"  # its time is when a sweep last asked for the cell
DONE, RUNNING, FAILED, INTERRUPTED = "done", "running", "failed", "interrupted"
MAX_NAME = 120  # characters of a folder's name


@dataclass(frozen=True)
class Cell:
    """How far a cell came.

    Attributes:
        name: Of its folder.
        state: `running`, `done`, `failed`; and `interrupted` where a running one is no longer worked on.
        error: First line of why it failed, None otherwise.
        started: Seconds since 1970, of the last start.
        ended: Of its end, None before.
    """

    name: str
    state: str
    error: str | None
    started: float
    ended: float | None


def run_cell(
    cfg: DictConfig,
    grid: Path,
    *,
    name: str,
    job_folder: Path,
    train: Callable[[DictConfig, Path], None] = run_training,
) -> Cell:
    """Train a cell unless it is finished; what goes wrong is recorded, so that a sweep goes on.

    Args:
        cfg: Composed and validated. The same config is the same cell, wherever else its job stands in a sweep.
        grid: Folder of all cells.
        name: Of the cell: what was swept.
        job_folder: Hydra's folder of the job; its `.hydra` goes along with the cell.
        train: Trains a config into a folder.

    Returns:
        How far it came.

    Raises:
        DataError: If its folder is a file, can not be written to, or holds an unreadable state.
    """
    folder = cell_folder(grid, cfg, name)
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / REQUEST_FILE).touch()
    with _alone(folder) as is_alone:
        cell = read_cell(folder)
        if cell is not None and cell.state == DONE:
            log.info("Finished before, skipped: %s", folder)
            return cell
        if not is_alone:
            log.warning("Worked on by another process, left to it: %s", folder)
            return cell or Cell(folder.name, RUNNING, None, time.time(), None)
        if (job_folder / ".hydra").is_dir():
            shutil.copytree(job_folder / ".hydra", folder / ".hydra", dirs_exist_ok=True)
        return _train(cfg, folder, train)


def cell_folder(grid: Path, cfg: DictConfig, name: str) -> Path:
    """The folder of a config's cell: one that is there, whatever it is called, or a new one."""
    code = config_hash(cfg)
    there = sorted(path.parent for path in grid.glob(f"*-{code}/{CELL_FILE}"))
    plain = name.replace("/", "_")[:MAX_NAME].strip() or str(cfg.name)
    return there[0] if there else grid / f"{plain}-{code}"


def read_cell(folder: Path) -> Cell | None:
    """How far a cell came; None where none was begun.

    Raises:
        DataError: If its file is unreadable.
    """
    file = folder / CELL_FILE
    if not file.exists():
        return None
    try:
        return Cell(name=folder.name, **json.loads(read_text(file)))
    except (ValueError, TypeError, RecursionError) as error:
        raise DataError(f"{file}: can not be read ({error}), expected a cell's state; remove it.") from error


def cells_of(grid: Path, *, since: float = 0.0) -> list[Cell]:
    """Cells of a grid that were begun, by name; a running one that nobody works on is interrupted.

    Args:
        grid: Folder of all cells.
        since: Leave out cells that no sweep has asked for since this time of the file system: a grid whose defaults have changed
            still holds those of before.
    """
    cells = []
    for file in sorted(grid.glob(f"*/{CELL_FILE}")):
        cell = read_cell(file.parent)
        request = file.with_name(REQUEST_FILE)
        if cell is None or (request.is_file() and request.stat().st_mtime < since):
            continue
        if cell.state == RUNNING:
            state = RUNNING if is_locked(file.with_name(LOCK_FILE)) else INTERRUPTED
            cell = Cell(cell.name, state, cell.error, cell.started, cell.ended)
        cells.append(cell)
    return cells


def _train(cfg: DictConfig, folder: Path, train: Callable[[DictConfig, Path], None]) -> Cell:
    """Train, from the cell's own checkpoint where it has one."""
    if has_checkpoint(folder):
        log.info("Goes on from the last checkpoint of %s.", folder)
        cfg = cfg.copy()
        cfg.ckpt_path = "last"
    (folder / ERROR_FILE).unlink(missing_ok=True)
    started = time.time()
    _write(folder, Cell(folder.name, RUNNING, None, started, None))
    try:
        with _logged(folder / LOG_FILE):
            train(cfg, folder)
        cell = Cell(folder.name, DONE, None, started, time.time())
    except Exception as error:
        write_text(folder / ERROR_FILE, traceback.format_exc())
        message = f"{type(error).__name__}: {' '.join(str(error).split())}"
        log.error("Failed, recorded in %s: %s", folder / ERROR_FILE, message)
        cell = Cell(folder.name, FAILED, message[:1000], started, time.time())
    _write(folder, cell)
    return cell


def _write(folder: Path, cell: Cell) -> None:
    content = {key: value for key, value in asdict(cell).items() if key != "name"}
    write_text(folder / CELL_FILE, json.dumps(content, indent=1))


@contextmanager
def _logged(file: Path) -> Iterator[None]:
    """Everything logged meanwhile, into a file too; a resumed run writes on."""
    handler = logging.FileHandler(file, encoding="utf-8")
    handler.setFormatter(logging.Formatter("[%(asctime)s][%(name)s][%(levelname)s] - %(message)s"))
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        handler.close()


@contextmanager
def _alone(folder: Path) -> Iterator[bool]:
    """Whether no other process works on a cell; until the end none will. The system frees the lock of a killed one."""
    try:
        import fcntl
    except ImportError:  # Windows: two commands at once on one grid are not guarded
        yield True
        return
    handle = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            yield False
            return
        yield True
    finally:
        os.close(handle)
