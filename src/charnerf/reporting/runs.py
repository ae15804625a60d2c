"""The runs below a folder: what they left on disk, and figures measured on their weights and kept beside them."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from charnerf.config.foreign import read_yaml
from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.errors import DataError
from charnerf.evaluation.records import read_record, write_record
from charnerf.files import is_locked, read_text
from charnerf.inference.model import Model
from charnerf.inference.weights import load
from charnerf.reporting.run_files import Curve, View, read_curve, read_metrics, read_views

CELL_FILE = "cell.json"  # how far a cell of a grid came; training writes it
LOCK_FILE = ".cell.lock"  # whoever works on the cell holds it
START_FILE = "start.txt"  # where weights began that were meant to begin pretrained; training writes it

Record = TypeVar("Record")
Content = TypeVar("Content", list, dict)


@dataclass(frozen=True)
class Run:
    """A finished run.

    Attributes:
        folder: Its folder.
        name: Its path below the report's folder.
        overrides: What its command line changed.
        config: Its composed config, {} where it has none.
        metrics: Content of its metrics.json.
        curve: Its curve.csv, [] where it has none.
        views: Its views.csv, None where it has none.
        start: Where its weights began, None where nothing is noted: all at random.
    """

    folder: Path
    name: str
    overrides: tuple[str, ...]
    config: Mapping[str, Any]
    metrics: Mapping[str, Any]
    curve: Curve
    views: Sequence[View] | None
    start: str | None = None

    @property
    def seed(self) -> int | None:
        """Its seed."""
        return self.config.get("seed")


@dataclass(frozen=True)
class Unfinished:
    """A run without metrics: its name, how far it came, why it failed (empty where nothing is recorded)."""

    name: str
    state: str
    error: str


def read_runs(folder: Path) -> list[Run]:
    """Every run below a folder that has its metrics.json, by path.

    Raises:
        DataError: If a file is unreadable.
    """
    return [_read_run(path.parent, folder) for path in sorted(folder.rglob("metrics.json"))]


def read_unfinished(folder: Path) -> list[Unfinished]:
    """Runs and cells below a folder that were begun and have no metrics, or whose record says that they failed."""
    begun = {path.parent for path in folder.rglob("config.yaml") if path.parent.name != ".hydra"}
    begun |= {path.parent for path in folder.rglob(CELL_FILE)}
    unfinished = []
    for path in sorted(begun):
        state, error = _cell_state(path / CELL_FILE)
        if (path / "metrics.json").is_file() and state != "failed":
            continue
        curve = read_curve(path / "curve.csv") if (path / "curve.csv").is_file() else []
        reached = f", {curve[-1]['step']:.0f} steps" if curve and "step" in curve[-1] else ""
        unfinished.append(Unfinished(_name(path, folder), f"{state}{reached}", error))
    return unfinished


def data_root(run: Run) -> Path:
    """The data set that a run was measured on.

    Raises:
        DataError: If it does not say where that is.
    """
    data = run.config.get("data")
    root = run.metrics.get("data_root") or (data.get("root") if isinstance(data, dict) else None)
    if not root:
        raise DataError(
            f"{run.folder}: does not say where its data set is; evaluate it again with this version."
        )
    return Path(str(root))


def measured(
    run: Run,
    file: str,
    kind: type[Record],
    measure: Callable[[Model, Sequence[Character]], Record],
    *,
    what: str,
    num_characters: int,
    trusted: Sequence[str],
) -> Record:
    """Figures of a run over its first test characters: read where they are newer than the weights, else made and kept.

    Args:
        run: The run.
        file: Name of the file of its folder that keeps them.
        kind: Frozen dataclass of the figures.
        measure: Makes them of the run's model and characters.
        what: What they are called in an error.
        num_characters: Characters at most.
        trusted: Modules of the user's own classes that the run's config may name.

    Raises:
        CharNeRFError: If weights or data are gone, the file is another one, or `measure` raises.
    """
    path, weights = run.folder / file, run.folder / "weights.safetensors"
    if path.is_file() and (not weights.is_file() or path.stat().st_mtime >= weights.stat().st_mtime):
        return read_record(path, kind, what=what)
    model = load(run.folder, trusted_targets=trusted)
    root = data_root(run)
    names = names_of(read_dataset(root), run.metrics["split"])[:num_characters]
    record = measure(model, [load_character(root, name) for name in names])
    write_record(path, record)
    return record


def _read_run(path: Path, folder: Path) -> Run:
    curve, views, start = path / "curve.csv", path / "views.csv", path / START_FILE
    return Run(
        folder=path,
        name=_name(path, folder),
        overrides=tuple(str(one) for one in _yaml(path / ".hydra" / "overrides.yaml", list)),
        config=_yaml(path / "config.yaml", dict),
        metrics=read_metrics(path / "metrics.json"),
        curve=read_curve(curve) if curve.is_file() else [],
        views=read_views(views) if views.is_file() else None,
        start=_first_line(start) if start.is_file() else None,
    )


def _first_line(path: Path) -> str:
    try:
        return read_text(path).strip()
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: is no text ({error}), expected where weights began; remove it.") from error


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path != folder else path.resolve().name


def _yaml(path: Path, kind: type[Content]) -> Content:
    """Content of a YAML file, empty where there is none.

    Raises:
        DataError: If it can not be read, or is of another kind.
    """
    content = (read_yaml(path) if path.is_file() else None) or kind()
    if not isinstance(content, kind):
        raise DataError(f"{path}: found {str(content)[:60]!r}, expected a {kind.__name__} as a run wrote it.")
    return content


def _cell_state(path: Path) -> tuple[str, str]:
    """State and error by a cell's record."""
    if not path.is_file():
        return "no metrics.json", ""
    try:
        content = json.loads(read_text(path))
        state, error = str(content["state"]), str(content.get("error") or "")
    except (OSError, ValueError, KeyError, AttributeError, TypeError, RecursionError) as problem:
        return "record unreadable", str(problem)
    if state == "running" and not is_locked(path.with_name(LOCK_FILE)):
        state = "interrupted"
    return state, error
