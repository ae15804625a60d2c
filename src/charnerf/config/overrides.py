"""Overrides as users type them, such as `combinator=mean` and `seed=0,1`, read by Hydra over a folder of config files."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from hydra import initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException

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
        try:
            parsed += parser.parse_overrides([one])
        except HydraException as error:
            first = str(error).splitlines()[0]
            raise ConfigError(f"{one}: can not be read ({first}), expected key=value.") from error
    return parsed


def jobs_of(overrides: Sequence[str]) -> list[list[str]]:
    """The overrides of every job of a sweep.

    Raises:
        ConfigError: If they can not be read, or a glob has no options.
    """
    try:
        return split_sweep(parse_overrides(overrides))
    except HydraException as error:
        raise ConfigError(f"{' '.join(overrides)}: {error}") from error


def trusted_by(overrides: Sequence[str]) -> list[str]:
    """Modules that `trusted_targets=[...]` names on a command line."""
    for override in parse_overrides(overrides):
        if override.key_or_group == "trusted_targets" and isinstance(override.value(), list):
            return [str(one) for one in override.value()]  # type: ignore[union-attr]
    return []
