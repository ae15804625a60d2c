"""What a search may choose, in the words of a grid: `scale.width=32,64`, `x=range(1,5)`, `x=tag(log,interval(1e-4,1e-2))`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hydra.core.override_parser.types import IntervalSweep, Override

from charnerf.config.overrides import config_files, parse_overrides
from charnerf.errors import ConfigError, DataError

Value = str | int | float


@dataclass(frozen=True)
class Choice:
    """One of several values, as typed."""

    values: tuple[str, ...]

    @property
    def probes(self) -> tuple[Value, ...]:
        """Values that show whether all are valid."""
        return self.values

    def holds(self, value: object) -> bool:
        """Whether a value is one of them."""
        return value in self.values


@dataclass(frozen=True)
class Interval:
    """A number from low to high, both included; whole if typed as int(interval(8,32)), drawn over its logarithm if so tagged."""

    low: float
    high: float
    is_whole: bool
    is_log: bool

    @property
    def probes(self) -> tuple[Value, ...]:
        """Values that show whether all are valid."""
        return (int(self.low), int(self.high)) if self.is_whole else (self.low, self.high)

    def holds(self, value: object) -> bool:
        """Whether a value is one of them."""
        is_number = isinstance(value, int if self.is_whole else int | float) and not isinstance(value, bool)
        return is_number and self.low <= value <= self.high  # type: ignore[operator]


@dataclass(frozen=True)
class SearchSpace:
    """What a search tries.

    Attributes:
        fixed: Overrides of every run.
        free: What is chosen, by full key.
    """

    fixed: tuple[str, ...]
    free: Mapping[str, Choice | Interval]

    def overrides(self, chosen: Mapping[str, Value]) -> list[str]:
        """The overrides of a run."""
        return [*self.fixed, *(f"{key}={value}" for key, value in chosen.items())]

    def check(self, chosen: Mapping[str, object], where: str) -> None:
        """Check what a search's journal, perhaps a stranger's, says was chosen: it becomes part of a command line.

        Raises:
            DataError: If a key or value can not have been chosen.
        """
        if chosen.keys() != self.free.keys() or not all(self.free[key].holds(chosen[key]) for key in chosen):
            raise DataError(
                f"{where}: found {str(dict(chosen))[:200]}, expected a choice of {', '.join(self.free)}."
            )

    def probes(self) -> list[list[str]]:
        """Overrides of runs that take each value once, others at their first."""
        first = {key: one.probes[0] for key, one in self.free.items()}
        others = [first | {key: value} for key, one in self.free.items() for value in one.probes[1:]]
        return [self.overrides(one) for one in (first, *others)]


def search_space(overrides: Sequence[str], conf: Path) -> SearchSpace:
    """Read a command line.

    Args:
        overrides: As for `train.py`.
        conf: Folder of the config files.

    Raises:
        ConfigError: If one can not be read, nothing is free, or an interval is none.
    """
    with config_files(conf):
        parsed = parse_overrides(overrides)
        free = {str(one.get_key_element()): _free(one) for one in parsed if one.is_sweep_override()}
    if not free:
        raise ConfigError(
            "search: found nothing to choose, expected values such as scale.width=32,64 or"
            " optimizer.lr='tag(log,interval(1e-4,1e-2))'."
        )
    return SearchSpace(tuple(one.input_line or "" for one in parsed if not one.is_sweep_override()), free)


def _free(override: Override) -> Choice | Interval:
    value = override.value()
    if not isinstance(value, IntervalSweep):
        return Choice(tuple(override.sweep_string_iterator()))
    low, high, is_log = value.start, value.end, "log" in value.tags
    if low is None or high is None or not low < high or (is_log and low <= 0):
        raise ConfigError(
            f"{override.input_line}: found {low} to {high}, expected a lower number first"
            f"{', above 0 for its logarithm' if is_log else ''}."
        )
    return Interval(low, high, isinstance(low, int) and isinstance(high, int), is_log)
