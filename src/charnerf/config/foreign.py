"""Configs that came with weights or run folders, perhaps from a stranger: read as values, in bounds, evaluating nothing."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from charnerf.config.bounds import MOST_BYTES, check_yaml, nodes_of
from charnerf.errors import ConfigError, DataError

UNREADABLE = (
    ValueError,
    TypeError,
    RecursionError,
    OverflowError,
)  # of text that is no JSON or YAML, or is too deep


def read_yaml(file: Path) -> Any:
    """Content of a YAML file that a run wrote.

    Raises:
        DataError: If it can not be read, or its anchors mean more than a config holds.
    """
    try:
        with file.open("rb") as opened:
            content = opened.read(MOST_BYTES + 1)
        check_yaml(content, str(file))
        return yaml.load(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except ConfigError as error:
        raise DataError(str(error)) from error
    except (OSError, yaml.YAMLError, *UNREADABLE) as error:
        problem = " ".join(str(error).split())[:200]
        raise DataError(f"{file}: can not be read ({problem}), expected YAML that a run wrote.") from error


def parse_json(text: str, where: str) -> Any:
    """A config as weights carry it.

    Raises:
        DataError: If it can not be read.
    """
    try:
        if len(text) > MOST_BYTES:
            raise ValueError(f"{len(text)} characters, at most {MOST_BYTES} are read")
        return json.loads(text)
    except UNREADABLE as error:
        problem = " ".join(str(error).split())[:200]
        raise DataError(
            f"{where}: its metadata holds no readable config ({problem}); write it again from its run."
        ) from error


def chosen_sections(plain: Any, names: Sequence[str] | None, where: str) -> DictConfig:
    """Some sections of a config, all if None; what the others hold is left out unread.

    Raises:
        DataError: If it is no config.
        ConfigError: If a section is too large, or holds an interpolation: runs write their values.
    """
    if not isinstance(plain, dict):
        raise DataError(f"{where}: found no sections, expected those of a config.")
    chosen = {key: value for key, value in plain.items() if names is None or key in names}
    try:
        for key, node in nodes_of(chosen).items():
            if (
                isinstance(node, str) and "${" in node
            ):  # it may read the environment, or whatever a program lets it
                raise ConfigError(f"{key}: found the interpolation {node[:60]!r}, expected a value.")
        return OmegaConf.create(chosen)
    except ConfigError as error:
        raise ConfigError(f"{where}: its config can not be used. {error}") from error
    except OmegaConfBaseException as error:
        problem = " ".join(str(error).split())[:200]
        raise DataError(f"{where}: holds what no config can ({problem}); write it again.") from error
