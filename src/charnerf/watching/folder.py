"""A folder that is watched: its runs, read again where their files changed."""

import hashlib
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import final

from charnerf.errors import CharNeRFError
from charnerf.files import is_locked
from charnerf.reporting.blocks import Block, Heading, Text
from charnerf.reporting.event_file import event_files
from charnerf.reporting.page import to_html, to_html_blocks
from charnerf.reporting.runs import CELL_FILE
from charnerf.training.run_lock import LOCK_FILE
from charnerf.watching.history import FOLDER, History, read_history
from charnerf.watching.page import REPORT, Watched, run_blocks, runs_blocks
from charnerf.watching.state import find_runs, read_state

TOLD = (
    "config.yaml",
    "metrics.json",
    REPORT,
    CELL_FILE,
)  # what a page hangs on, beside TensorBoard's files and the lock


@final
class WatchedFolder:
    """A run, or runs below a folder.

    Args:
        folder: Of them.

    Raises:
        DataError: If there is no run.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._histories: dict[Path, tuple[str, History]] = {}
        self.watched()

    def watched(self) -> list[Watched]:
        """The runs as they are now, by name; a file that vanishes meanwhile is as if it had not been there."""
        return [self._watched(run) for run in find_runs(self.folder)]

    def tag(self) -> str:
        """What changes whenever a page may."""
        facts = [[str(run), _stamps(run), is_locked(run / LOCK_FILE)] for run in find_runs(self.folder)]
        return hashlib.sha256(repr([facts, _stamp(self.folder / REPORT)]).encode()).hexdigest()[:16]

    def page(self, name: str | None, *, whole: bool) -> str:
        """The page of a run by its name, or of all where none is named: whole, refreshing itself, or its blocks alone.

        Raises:
            KeyError: If there is no such run.
        """
        with tempfile.TemporaryDirectory(prefix="charnerf-watch-") as scratch:
            try:
                blocks: Sequence[Block] = self._blocks(name, Path(scratch))
            except (CharNeRFError, OSError) as error:
                blocks = [
                    Heading("charnerf watch", 1),
                    Text(f"Can not be read now: {error} It is tried again."),
                ]
            title = f"{name or self.folder.resolve().name}: charnerf watch"
            return to_html(title, blocks, refreshes=True) if whole else to_html_blocks(blocks)

    def report(self, name: str) -> Path | None:
        """The report of a run by its name, of all where that is empty; None where there is none."""
        places = {"": self.folder} | {self._name(run): run for run in find_runs(self.folder)}
        file = places[name] / REPORT if name in places else None
        return file if file is not None and file.is_file() else None

    def _blocks(self, name: str | None, scratch: Path) -> list[Block]:
        runs = self.watched()
        if name is None and [one.state.name for one in runs] != [self._name(self.folder)]:
            report = (self.folder / REPORT).is_file()
            return runs_blocks(runs, self.folder.resolve().name, report, scratch)
        by_name = {one.state.name: one for one in runs}
        return run_blocks(by_name[name or self._name(self.folder)], scratch)

    def _watched(self, run: Path) -> Watched:
        name = self._name(run)
        history = self._history(run)
        return Watched(run, read_state(run, name, history), history, (run / REPORT).is_file())

    def _history(self, run: Path) -> History:
        """Read where its files are others than before."""
        stamp = repr([_stamp(file) for file in event_files(run / FOLDER)])
        before = self._histories.get(run)
        if before is None or before[0] != stamp:
            self._histories[run] = (stamp, read_history(run))
        return self._histories[run][1]

    def _name(self, run: Path) -> str:
        return run.resolve().name if run == self.folder else run.relative_to(self.folder).as_posix()


def _stamps(run: Path) -> list[object]:
    return [_stamp(file) for file in [*event_files(run / FOLDER), *(run / name for name in TOLD)]]


def _stamp(file: Path) -> tuple[str, int, int] | None:
    """What changes with a file's content; None where there is none."""
    try:
        stat = file.stat()
    except OSError:
        return None
    return file.name, stat.st_size, stat.st_mtime_ns
