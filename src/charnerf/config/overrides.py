"""Overrides as users type them, such as `combinator=mean` and `seed=0,1`, read by Hydra over a folder of config files."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from hydra import initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, Override, RangeSweep
from hydra.errors import HydraException

from charnerf.config.bounds import DEEPEST, LONGEST, MOST_JOBS
from charnerf.config.hydra_internals import split_sweep
from charnerf.errors import ConfigError


@contextmanager
def config_files(folder: Path) -> Iterator[None]:
    """Hydra's global state, set up for a folder of config files and cleared again."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(folder), version_base="1.3", job_name="train"):
        yield


def options_in(group: str) -> list[str]:
    """Options of a group of the config files, empty where there is no such group."""
    return GlobalHydra.instance().config_loader().get_group_options(group)


def parse_overrides(overrides: Sequence[str]) -> list[Override]:
    """Read overrides.

    Raises:
        ConfigError: Names the first that can not be read.
    """
    loader = GlobalHydra.instance().config_loader() if GlobalHydra.instance().is_initialized() else None
    parser = OverridesParser.create(config_loader=loader)  # type: ignore[arg-type]
    parsed: list[Override] = []
    for one in overrides:
        _check_length(one)
        try:
            parsed += parser.parse_overrides([one])
        except (HydraException, ValueError) as error:  # ValueError: a number of thousands of digits
            first = str(error).splitlines()[0]
            raise ConfigError(f"{one}: can not be read ({first}), expected key=value.") from error
    return parsed


def jobs_of(overrides: Sequence[str]) -> list[list[str]]:
    """The overrides of every job of a sweep.

    Raises:
        ConfigError: If they can not be read, a glob has no options, or they are more jobs than a sweep may have.
    """
    try:
        parsed = parse_overrides(overrides)
        _check_jobs(parsed)
        return split_sweep(parsed)
    except HydraException as error:
        raise ConfigError(f"{' '.join(overrides)}: {error}") from error


def _check_length(override: str) -> None:
    """Refuse an override that would take the parser minutes, or all of its stack."""
    depth = deepest = 0
    for sign in override[: LONGEST + 1]:
        depth += (sign in "[{(") - (sign in ")}]")
        deepest = max(deepest, depth)
    if len(override) > LONGEST or deepest > DEEPEST:
        key = override.partition("=")[0][:60]
        raise ConfigError(
            f"{key}: found {len(override)} characters and {deepest} brackets within each other, expected at most {LONGEST}"
            f" and {DEEPEST}."
        )


def _check_jobs(overrides: Sequence[Override]) -> None:
    """Refuse a sweep of more jobs than anybody means."""
    jobs = 1.0
    for one in overrides:
        value = one.value()
        if isinstance(value, ChoiceSweep):
            jobs *= max(1, len(value.list))
        elif isinstance(value, RangeSweep):
            jobs *= max(1.0, abs((value.stop or 0) - (value.start or 0)) / (abs(value.step) or 1e-9))
        if jobs > MOST_JOBS:
            raise ConfigError(
                f"{one.key_or_group}: with it the sweep has more than {MOST_JOBS} jobs, expected fewer."
            )


def trusted_by(overrides: Sequence[str]) -> list[str]:
    """Modules that `trusted_targets=[...]` names on a command line."""
    for override in parse_overrides(overrides):
        if override.key_or_group == "trusted_targets" and isinstance(override.value(), list):
            return [str(one) for one in override.value()]  # type: ignore[union-attr]
    return []
