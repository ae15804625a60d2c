"""The runs below a folder, and rows of them: the same config with several seeds is one row."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

import yaml

from charnerf.errors import DataError
from charnerf.reporting.parts import read_metrics
from charnerf.reporting.plots import Curve, read_curve
from charnerf.reporting.views import ViewTable, read_views

CELL_FILE = "cell.json"  # how far a cell of a grid came; training writes it
START_FILE = "start.txt"  # where weights began that were meant to begin pretrained; training writes it
SEED, RESUMED, EXPERIMENT = "seed", "ckpt_path", "experiment"


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
    views: ViewTable | None
    start: str | None = None

    @property
    def seed(self) -> int | None:
        """Its seed."""
        return self.config.get(SEED)


@dataclass(frozen=True)
class Row:
    """A row of the table: one config, its seeds.

    Attributes:
        label: What distinguishes it from the other rows.
        experiment: Its row of the paper's Table II, None where it is none of them.
        runs: One a seed.
        variant: What distinguishes it beside its experiment, "" where nothing does.
    """

    label: str
    experiment: str | None
    runs: tuple[Run, ...]
    variant: str = ""

    def values(self, *keys: str) -> list[float]:
        """A figure of every run that has it, by its keys in metrics.json."""
        found = []
        for run in self.runs:
            value: Any = run.metrics
            for key in keys:
                value = value.get(key) if isinstance(value, Mapping) else None
            if value is not None:
                found.append(float(value))
        return found

    def mean(self, *keys: str) -> float | None:
        """Mean over the seeds, None where no run has the figure."""
        values = self.values(*keys)
        return fmean(values) if values else None

    def spread(self, *keys: str) -> float | None:
        """Standard deviation over the seeds, None below two of them."""
        values = self.values(*keys)
        return stdev(values) if len(values) > 1 else None


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
    found = []
    for path in sorted(begun):
        state, error = _cell(path / CELL_FILE)
        if (path / "metrics.json").is_file() and state != "failed":
            continue
        curve = read_curve(path / "curve.csv") if (path / "curve.csv").is_file() else []
        reached = f", {curve[-1]['step']:.0f} steps" if curve and "step" in curve[-1] else ""
        found.append(Unfinished(_name(path, folder), f"{state}{reached}", error))
    return found


def group_rows(runs: Sequence[Run]) -> list[Row]:
    """Rows of runs, in the order in which their first runs stand; runs of one config but its seed share one."""
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(_without_seed(run), []).append(run)
    members = list(groups.values())
    common = set.intersection(*(set(run.overrides) for run in runs)) if runs else set()
    own = [
        [one for one in group[0].overrides if one not in common and not _is_seed(one)] for group in members
    ]
    names = _short_names(own)
    variants = [" ".join(_renamed(one, names) for one in each if _key(one) != EXPERIMENT) for each in own]
    labels = [
        _label(group[0], each, variant) for group, each, variant in zip(members, own, variants, strict=True)
    ]
    twice = {
        label for label in labels if labels.count(label) > 1
    }  # something beside the command line differs
    labels = [
        f"{label} ({group[0].name})" if label in twice else label
        for label, group in zip(labels, members, strict=True)
    ]
    return [
        Row(label, _experiment(group[0]), tuple(group), variant)
        for label, group, variant in zip(labels, members, variants, strict=True)
    ]


def common_overrides(runs: Sequence[Run]) -> list[str]:
    """What all runs' command lines share, seeds aside."""
    shared = set.intersection(*(set(run.overrides) for run in runs)) if runs else set()
    return [one for one in runs[0].overrides if one in shared and not _is_seed(one)] if runs else []


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


def _read_run(path: Path, folder: Path) -> Run:
    curve, views, start = path / "curve.csv", path / "views.csv", path / START_FILE
    return Run(
        folder=path,
        name=_name(path, folder),
        overrides=tuple(_yaml(path / ".hydra" / "overrides.yaml") or ()),
        config=_yaml(path / "config.yaml") or {},
        metrics=read_metrics(path / "metrics.json"),
        curve=read_curve(curve) if curve.is_file() else [],
        views=read_views(views) if views.is_file() else None,
        start=start.read_text(encoding="utf-8").strip() if start.is_file() else None,
    )


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path != folder else path.resolve().name


def _yaml(path: Path) -> Any:
    """Content of a YAML file, None where there is none."""
    if not path.is_file():
        return None
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        told = " ".join(str(error).split())[:200]
        raise DataError(f"{path}: can not be read ({told}), expected the YAML that a run wrote.") from error


def _cell(path: Path) -> tuple[str, str]:
    """State and error that a cell's record tells."""
    if not path.is_file():
        return "no metrics.json", ""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        state, error = str(content["state"]), str(content.get("error") or "")
    except (OSError, ValueError, KeyError, AttributeError) as problem:
        return "record unreadable", str(problem)
    return ("running or killed" if state == "running" else state), error


def _is_seed(override: str) -> bool:
    return _key(override) in (SEED, RESUMED)


def _without_seed(run: Run) -> str:
    """What two runs of one row have in common; a run without a config stands alone."""
    if not run.config:
        return f"run {run.name}"
    kept = {key: value for key, value in run.config.items() if key not in (SEED, RESUMED, "trusted_targets")}
    return json.dumps(kept, sort_keys=True, default=str)


def _experiment(run: Run) -> str | None:
    chosen = [one.split("=", 1)[1] for one in run.overrides if one.split("=", 1)[0] == EXPERIMENT]
    return chosen[0] if chosen else None


def _label(run: Run, own: Sequence[str], variant: str) -> str:
    """What a run's command line says that not all of them say."""
    chosen = [one.split("=", 1)[1] for one in own if _key(one) == EXPERIMENT]
    words = " ".join([*chosen, variant]).strip()
    return words or _experiment(run) or (str(run.config["name"]) if "name" in run.config else run.name)


def _key(override: str) -> str:
    return override.split("=", 1)[0].lstrip("+~")


def _short_names(own: Sequence[Sequence[str]]) -> dict[str, str]:
    """Last part of every key that rows differ in; the whole key where two end alike."""
    keys = list(dict.fromkeys(_key(one) for each in own for one in each))
    last = [key.split(".")[-1] for key in keys]
    return {key: key if last.count(short) > 1 else short for key, short in zip(keys, last, strict=True)}


def _renamed(override: str, names: Mapping[str, str]) -> str:
    return f"{names[_key(override)]}={override.split('=', 1)[1]}" if "=" in override else override
