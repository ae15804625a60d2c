"""Folders of config files that a command line adds to charnerf's own, perhaps a stranger's: in bounds, and silent to Hydra.

What Hydra runs (launchers, sweepers, callbacks, loggers, the environment of jobs) is the user's to type, never a file's.
"""

import json
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra import compose
from hydra.errors import HydraException
from omegaconf import ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from charnerf.config.bounds import MOST_BYTES, check_yaml
from charnerf.config.overrides import config_files, parse_overrides
from charnerf.config.problems import differing
from charnerf.errors import ConfigError

SEARCH_PATH = "hydra.searchpath"
FREE = (  # Hydra's settings that a file may make: where things go, and what they are called
    "run",
    "sweep",
    "output_subdir",
    "job.name",
    "job.chdir",
    "job.id",
    "job.num",
    "job.config_name",
    "job.override_dirname",
    "job.config.override_dirname",
    "help",
    "hydra_help",
    "overrides",
    "runtime",
    SEARCH_PATH.removeprefix("hydra."),  # checked by itself: it is followed before anything else
)


def given_search_path(args: Namespace, name: str) -> list[str]:
    """Folders and packages that a command line adds; their files are checked, those of `--config-path` too.

    Args:
        args: The command line, as Hydra reads it.
        name: Of the primary file.

    Raises:
        ConfigError: If a file is too large or no YAML, or the primary file adds folders of its own.
    """
    typed = [
        one.value() for one in parse_overrides(_hydras(args.overrides)) if one.key_or_group == SEARCH_PATH
    ]
    entries = [str(entry) for value in typed if isinstance(value, list) for entry in ListConfig(value)]
    if args.config_dir:
        entries.append(f"file://{Path(args.config_dir).resolve()}")
    folders = [Path(one.removeprefix("file://")) for one in entries if not one.startswith("pkg://")]
    for folder in [*([Path(args.config_path)] if args.config_path else []), *folders]:
        check_config_files(folder)
    if args.config_path:
        _check_primary(Path(args.config_path) / f"{name}.yaml")
    return entries


def with_search_path(overrides: Sequence[str], entries: Sequence[str]) -> list[str]:
    """Overrides by which `compose` looks where the command line does."""
    others = [one for one in overrides if not one.lstrip("+").startswith(f"{SEARCH_PATH}=")]
    quoted = ",".join(json.dumps(entry) for entry in entries)
    return [f"{SEARCH_PATH}=[{quoted}]", *others] if entries else others


def hydras_settings(name: str, overrides: Sequence[str]) -> dict[str, Any]:
    """Hydra's own settings by their keys, as they are composed over the config files that are set up; nothing is resolved."""
    composed = compose(name, overrides=list(overrides), return_hydra_config=True)
    return dict(_flat(OmegaConf.to_container(composed.hydra, resolve=False)))


def typed_settings(overrides: Sequence[str], conf: Path) -> dict[str, Any]:
    """Hydra's own settings by charnerf's config files and a command line alone.

    Raises:
        ConfigError: If it names an option that neither they nor Hydra's plugins have.
    """
    try:
        with config_files(conf):
            return hydras_settings("train", with_search_path(_hydras(overrides), ()))
    except HydraException as error:
        raise ConfigError(
            f"{str(error).splitlines()[0]} in charnerf's config files or Hydra's plugins, expected Hydra's options there: what it"
            " runs is never a given file's."
        ) from error


def check_hydra(typed: Mapping[str, Any], composed: Mapping[str, Any]) -> None:
    """Check that given files leave Hydra's own settings as `typed_settings` has them.

    Raises:
        ConfigError: Names a setting that a file makes.
    """
    if keys := differing(typed, composed, FREE):
        raise ConfigError(
            f"hydra.{keys[0]}: set by a file of --config-dir, --config-path or {SEARCH_PATH}, expected on the command line"
            f" alone, since Hydra runs what it says ({len(keys)} such settings)."
        )


def check_config_files(folder: Path) -> None:
    """Check that config files are small when their anchors are expanded, before Hydra expands them.

    Raises:
        ConfigError: If one is not, or is no YAML.
    """
    for file in sorted(folder.rglob("*.yaml")):
        try:
            with file.open("rb") as opened:
                check_yaml(opened.read(MOST_BYTES + 1), str(file))
        except (YAMLError, OSError) as error:
            raise ConfigError(
                f"{file}: can not be read ({' '.join(str(error).split())[:200]}), expected YAML."
            ) from error


def _check_primary(file: Path) -> None:
    """Refuse a primary file that adds folders or packages: Hydra imports a package to look into it."""
    try:
        found = OmegaConf.select(OmegaConf.load(file), SEARCH_PATH) if file.is_file() else None
    except OmegaConfBaseException as error:
        raise ConfigError(f"{file}: {SEARCH_PATH} can not be read ({error}); leave it out.") from error
    if found:
        raise ConfigError(
            f"{file}: sets {SEARCH_PATH}, expected it on the command line alone; type it there."
        )


def _flat(node: Any, key: str = "") -> list[tuple[str, Any]]:
    if not isinstance(node, Mapping) or not node:
        return [(key, node)]
    return [
        pair for name, value in node.items() for pair in _flat(value, f"{key}.{name}" if key else str(name))
    ]


def _hydras(overrides: Sequence[str]) -> list[str]:
    """The overrides of Hydra's own settings."""
    return [one for one in overrides if one.lstrip("+~").startswith(("hydra.", "hydra/"))]
