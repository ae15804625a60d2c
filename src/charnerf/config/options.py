"""The config files: where they are, and one option of a group by itself."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from charnerf.config.hints import nearest
from charnerf.errors import ConfigError


def conf_folder() -> Path:
    """Folder of the config files: inside the installed package, or beside `src` in a checkout.

    Raises:
        ConfigError: If there is none.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "conf", package.parents[1] / "conf"):
        if (folder / "train.yaml").is_file():
            return folder
    raise ConfigError(
        f"{package / 'conf'}: no config files found, expected train.yaml there; install charnerf again."
    )


def options_of(group: str) -> list[str]:
    """Names of the options of a group, sorted."""
    return sorted(file.stem for file in (conf_folder() / group).glob("*.yaml"))


def option(group: str, name: str, *, like: Mapping[str, Any] | None = None) -> DictConfig:
    """Read one option of a group: its values as the YAML says, but for those that another section of the group sets.

    Args:
        group: Such as `renderer`.
        name: Such as `adaptive`.
        like: A resolved section of the group, such as a trained model's; it brings the sizes that the YAML takes from the scale.

    Returns:
        The section, with the option's own `_target_`.

    Raises:
        ConfigError: If there is no such option.
    """
    names = options_of(group)
    if name not in names:
        raise ConfigError(f"{group}: found no option '{name}'; {nearest(name, names)}")
    section = OmegaConf.load(conf_folder() / group / f"{name}.yaml")
    same = {key: value for key, value in (like or {}).items() if key in section and key != "_target_"}
    return OmegaConf.merge(section, same)  # type: ignore[return-value]
