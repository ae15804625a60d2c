"""Rows of a report: runs of one config that differ in their seed alone, named by what sets them apart."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any

from charnerf.reporting.runs import Run

SEED, RESUMED, EXPERIMENT = "seed", "ckpt_path", "experiment"


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
        figures = []
        for run in self.runs:
            value: Any = run.metrics
            for key in keys:
                value = value.get(key) if isinstance(value, Mapping) else None
            if value is not None:
                figures.append(float(value))
        return figures

    def mean(self, *keys: str) -> float | None:
        """Mean over the seeds, None where no run has the figure."""
        values = self.values(*keys)
        return fmean(values) if values else None

    def spread(self, *keys: str) -> float | None:
        """Standard deviation over the seeds, None below two of them."""
        values = self.values(*keys)
        return stdev(values) if len(values) > 1 else None


def group_rows(runs: Sequence[Run]) -> list[Row]:
    """Rows of runs, in the order in which their first runs stand; runs of one config but its seed share one."""
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(_without_seed(run), []).append(run)
    members = list(groups.values())
    common = set(common_overrides(runs))
    own = [
        [one for one in group[0].overrides if one not in common and not _is_seed(one)] for group in members
    ]
    names = _short_names(own)
    variants = [" ".join(_renamed(one, names) for one in each if _key(one) != EXPERIMENT) for each in own]
    labels = [
        _label(group[0], each, variant) for group, each, variant in zip(members, own, variants, strict=True)
    ]
    labels = [  # of two alike, something beside the command line differs
        f"{label} ({group[0].name})" if labels.count(label) > 1 else label
        for label, group in zip(labels, members, strict=True)
    ]
    return [
        Row(label, _experiment(group[0].overrides), tuple(group), variant)
        for label, group, variant in zip(labels, members, variants, strict=True)
    ]


def common_overrides(runs: Sequence[Run]) -> list[str]:
    """What all runs' command lines share, seeds aside."""
    if not runs:
        return []
    common = set.intersection(*(set(run.overrides) for run in runs))
    return [one for one in runs[0].overrides if one in common and not _is_seed(one)]


def _is_seed(override: str) -> bool:
    return _key(override) in (SEED, RESUMED)


def _without_seed(run: Run) -> str:
    """What two runs of one row have in common; a run without a config stands alone."""
    if not run.config:
        return f"run {run.name}"
    kept = {key: value for key, value in run.config.items() if key not in (SEED, RESUMED, "trusted_targets")}
    return json.dumps(kept, sort_keys=True, default=str)


def _experiment(overrides: Sequence[str]) -> str | None:
    """The one that they choose, None where they choose none, or leave the group out (`~experiment`)."""
    return next(
        (one.removeprefix(f"{EXPERIMENT}=") for one in overrides if one.startswith(f"{EXPERIMENT}=")), None
    )


def _label(run: Run, own: Sequence[str], variant: str) -> str:
    """What a run's command line says that not all of them say."""
    words = " ".join([_experiment(own) or "", variant]).strip()
    return (
        words or _experiment(run.overrides) or (str(run.config["name"]) if "name" in run.config else run.name)
    )


def _key(override: str) -> str:
    return override.split("=", 1)[0].lstrip("+~")


def _short_names(own: Sequence[Sequence[str]]) -> dict[str, str]:
    """Every key that rows differ in, without its section; the whole key where two end alike."""
    keys = list(dict.fromkeys(_key(one) for each in own for one in each))
    last = [key.split(".", maxsplit=1)[-1] for key in keys]
    return {key: key if last.count(short) > 1 else short for key, short in zip(keys, last, strict=True)}


def _renamed(override: str, names: Mapping[str, str]) -> str:
    return f"{names[_key(override)]}={override.split('=', 1)[1]}" if "=" in override else override
