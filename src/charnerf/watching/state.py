"""How far a run is, and whether anybody still works on it."""

import json
import math
import os
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from charnerf.config.foreign import read_yaml
from charnerf.errors import CharNeRFError, DataError
from charnerf.files import is_locked, read_text
from charnerf.progress import left_text
from charnerf.reporting.run_files import read_metrics
from charnerf.reporting.runs import CELL_FILE
from charnerf.training.run_lock import LOCK_FILE
from charnerf.watching.history import SECONDS, History

MOST_RUNS = 200  # below one folder
METRICS_FILE = "metrics.json"
MARKS = {"config.yaml", CELL_FILE}  # a run has one of them


class Stage(StrEnum):
    """What a run does."""

    BEGUN = "begins"
    TRAINS = "trains"
    MEASURES = "trained, is measured"
    DONE = "done"
    STOPPED = "stopped before its end"
    FAILED = "failed"

    @property
    def is_over(self) -> bool:
        """Whether nobody works on it."""
        return self in (Stage.DONE, Stage.STOPPED, Stage.FAILED)


@dataclass(frozen=True)
class State:
    """How far a run is.

    Attributes:
        name: Its path below the folder that is watched.
        stage: What it does.
        share: Of its budget that training has used up, in [0, 1]; None where that is not known.
        steps: Done: what its metrics tell, until then what it wrote last.
        seconds: Of training, as the steps.
        left_s: Training seconds left, None where nobody trains or it is not known.
        psnr_foreground: The newest of validation, dB.
        error: Why it failed.
    """

    name: str
    stage: Stage
    share: float | None
    steps: int
    seconds: float
    left_s: float | None
    psnr_foreground: float | None
    error: str

    @property
    def left(self) -> str:
        """Time left in words, nothing where that is not known."""
        return "" if self.left_s is None else left_text(self.left_s)


def find_runs(folder: Path) -> list[Path]:
    """The run that a folder is, or those below it, by name; hidden folders, and what lies in a run, hold none.

    Raises:
        DataError: If there is none, or there are too many to watch.
    """
    runs = []
    for place, folders, files in os.walk(folder):
        if MARKS & set(files):
            runs.append(Path(place))
            folders.clear()
        folders[:] = sorted(name for name in folders if not name.startswith("."))
    if not runs:
        raise DataError(
            f"{folder}: found no run in it or below it, expected one that has begun; name its folder."
        )
    if len(runs) > MOST_RUNS:
        raise DataError(
            f"{folder}: found {len(runs)} runs below it, expected {MOST_RUNS} at most; name a grid or a run."
        )
    return runs


def read_state(run: Path, name: str, history: History) -> State:
    """How far a run is by its files, whichever of them are there; half of one tells nothing.

    Args:
        run: Its folder.
        name: What it is called.
        history: What it wrote.
    """
    is_over, cell = not is_locked(run / LOCK_FILE), _cell(run)
    is_measured = (  # and not by metrics of before
        is_over and cell.get("state") in (None, "done") and (run / METRICS_FILE).is_file()
    )
    steps, seconds = (_measured(run) if is_measured else None) or _newest(history)
    share = _share(run, steps, seconds)
    if not is_over:
        stage = _stage_at_work(steps, share)
    elif is_measured:
        stage = Stage.DONE
    else:
        stage = Stage.FAILED if cell.get("state") == "failed" else Stage.STOPPED
    trains = stage is Stage.TRAINS and share is not None and share > 0.0
    return State(
        name=name,
        stage=stage,
        share=share,
        steps=steps,
        seconds=seconds,
        left_s=seconds * (1.0 - share) / share if trains and share is not None else None,
        psnr_foreground=history.last("val/psnr_foreground"),
        error=str(cell.get("error") or "")[:1000] if stage is Stage.FAILED else "",
    )


def _stage_at_work(steps: int, share: float | None) -> Stage:
    """Of a run whose lock is held; the system frees that of a killed process."""
    if (share or 0.0) >= 1.0:
        return Stage.MEASURES
    return Stage.TRAINS if steps else Stage.BEGUN


def _measured(run: Path) -> tuple[int, float] | None:
    """Steps and training seconds that its metrics tell; None where they do not."""
    try:
        metrics = read_metrics(run / METRICS_FILE)
        return int(metrics["steps"]), float(metrics["seconds"]["train"])
    except (CharNeRFError, KeyError, TypeError, ValueError):
        return None


def _newest(history: History) -> tuple[int, float]:
    """Steps and training seconds of what was written last."""
    return max(history.points.get("train/loss/total", {0: 0.0})), history.last(SECONDS) or 0.0


def _share(run: Path, steps: int, seconds: float) -> float | None:
    """Of the budget, whichever of its bounds is nearer."""
    try:
        config = read_yaml(run / "config.yaml")
        budget = config["budget"]
        bounds = [(steps, budget.get("steps")), (seconds, budget.get("seconds"))]
        shares = [
            spent / float(bound)
            for spent, bound in bounds
            if bound is not None and 0 < float(bound) < math.inf
        ]
    except (CharNeRFError, OSError, TypeError, KeyError, AttributeError, ValueError):
        return None
    return min(max(shares), 1.0) if shares else None


def _cell(run: Path) -> dict[str, Any]:
    """Its record in a grid, nothing where it has none."""
    try:
        content = json.loads(read_text(run / CELL_FILE))
    except (CharNeRFError, OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}
