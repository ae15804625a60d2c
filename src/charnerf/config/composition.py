"""From overrides to a composed config; what Hydra refuses becomes one clear message."""

import re
from collections.abc import Sequence
from pathlib import Path

from hydra import compose
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import ConfigCompositionException, HydraException, MissingConfigException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from charnerf.config.choices import check_choice, no_option
from charnerf.config.hints import nearest
from charnerf.config.options import conf_folder
from charnerf.config.overrides import config_files, options_in, parse_overrides, trusted_by
from charnerf.config.validation import validate
from charnerf.errors import ConfigError


def compose_config(
    overrides: Sequence[str] = (), *, conf: Path | None = None, name: str = "train"
) -> DictConfig:
    """Compose a config as `train.py` does, and validate it.

    Args:
        overrides: As on the command line: `combinator=mean`, `scale.width=32`.
        conf: Folder of the config files; the package's own by default.
        name: The primary file.

    Raises:
        ConfigError: Lists everything that is wrong with it.
    """
    with config_files(conf or conf_folder()):
        cfg = compose_unchecked(name, overrides)
    validate(cfg, trusted_targets=trusted_by(overrides))
    return cfg


def compose_unchecked(name: str, overrides: Sequence[str]) -> DictConfig:
    """Compose over the config files that are set up; a key that Hydra does not know is let in.

    `validate` names such a key beside all other problems.

    Raises:
        ConfigError: If an option or a group does not exist, or an override can not be read.
    """
    parsed = parse_overrides(overrides)
    for override in parsed:
        check_choice(override)
    accepted = [override.input_line or "" for override in parsed]
    for _ in range(len(accepted) + 1):  # each round lets one unknown key in
        try:
            return compose(name, overrides=accepted)
        except MissingConfigException as error:
            raise _no_file(error) from error
        except ConfigCompositionException as error:
            accepted = _with_unknown_key(accepted, error)
        except (HydraException, OmegaConfBaseException) as error:
            raise _refused(error) from error
    raise ConfigError(f"{' '.join(overrides)}: can not be composed; check each key=value.")


def _with_unknown_key(overrides: Sequence[str], error: ConfigCompositionException) -> list[str]:
    """The overrides with `++` before the one whose key Hydra does not know."""
    unknown = re.match(r"Could not override '([^']+)'", str(error))
    if unknown is None or unknown[1].startswith("hydra."):
        raise _refused(error) from error
    key = unknown[1]
    typed = next((one for one in overrides if one.startswith(f"{key}=")), None)
    if typed is None:
        raise _refused(error) from error
    if "/" in key:
        groups = GlobalHydra.instance().config_loader().list_groups("")
        raise ConfigError(f"{key}: unknown group; {nearest(key, groups)}") from error
    return [f"++{one}" if one is typed else one for one in overrides]


def _no_file(error: MissingConfigException) -> ConfigError:
    """The error about an option or primary file that is not there."""
    group, _, option = (error.missing_cfg_file or "").rpartition("/")
    if group:
        return no_option(group, option, list(error.options or options_in(group)))
    return ConfigError(
        f"--config-name: found no file {error.missing_cfg_file}.yaml among the config files; leave it out for `train`."
    )


def _refused(error: BaseException) -> ConfigError:
    """What Hydra says, on one line."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    if error.__cause__ is not None:
        lines += str(error.__cause__).splitlines()[:1]
    return ConfigError(" ".join(lines[:3]))
