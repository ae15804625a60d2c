"""Reports everything that is wrong with a config, in one error, before any work."""

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import make_dataclass
from pathlib import Path
from typing import Any, get_type_hints

from hydra.errors import InstantiationException
from hydra.utils import instantiate
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from charnerf.config.bounds import check_values
from charnerf.config.checks import BROKEN, MISSING, check_section
from charnerf.config.hints import shown
from charnerf.config.problems import Problems, join
from charnerf.config.rules import RULES, idle_settings
from charnerf.config.schema import MODEL_SECTIONS, RunConfig
from charnerf.errors import ConfigError
from charnerf.wording import counted

INTERPOLATION = re.compile(r"\$\{([\w.]+)\}")


def validate(cfg: DictConfig, *, trusted_targets: Sequence[str] = ()) -> None:
    """Check a composed config whole, before anything is built from it.

    Args:
        cfg: The config, with or without its interpolations resolved.
        trusted_targets: Modules whose classes `_target_` may name besides charnerf's own, as the user typed
            them. Never take them from the config itself: it may have come with a run folder from elsewhere.

    Raises:
        ConfigError: Lists every problem, each with its full key.
    """
    _validate_against(RunConfig, cfg, trusted_targets)
    tried = {"schedule": cfg.schedule, "data": cfg.data} | {
        f"loss.{name}": cfg.loss[name] for name in cfg.loss
    }
    refused = [line for key, part in tried.items() for line in _refusals(part, key)]
    if refused:
        raise ConfigError(as_message(refused))


def _refusals(part: DictConfig, key: str) -> list[str]:
    """What the class of a part says against its values: its constructor only keeps and checks them."""
    try:
        instantiate(part, _convert_="all")
    except InstantiationException as error:
        message = str(error.__cause__ or error)
        return [message if message.startswith(f"{key}.") else f"{key}: {message}"]
    return []


def validate_model(cfg: DictConfig, *, trusted_targets: Sequence[str] = ()) -> None:
    """Check, as `validate` does, what the model needs of a config that came with weights."""
    hints = get_type_hints(RunConfig, include_extras=True)
    schema = make_dataclass("ModelConfig", [(name, hints[name]) for name in MODEL_SECTIONS], frozen=True)
    _validate_against(schema, cfg, trusted_targets, sections=MODEL_SECTIONS)


def check_files(cfg: DictConfig) -> None:
    """Check that the data set, its splits, the checkpoint and the weights that a valid config names are there and of its sizes.

    Raises:
        ConfigError: Names each one that is not.
    """
    problems = Problems()
    if cfg.ckpt_path not in (None, "last") and not Path(cfg.ckpt_path).is_file():
        problems.add(
            "ckpt_path", f"found '{cfg.ckpt_path}', which is no file; expected a .ckpt, `last` or null."
        )
    if cfg.start_from not in (None, "released") and not Path(cfg.start_from).exists():
        problems.add(
            "start_from",
            f"found '{cfg.start_from}', which does not exist; expected `released`, a run folder, a .ckpt, a .safetensors or null.",
        )
    lines = problems.lines()
    try:
        data = instantiate(cfg.data, _convert_="all")
        data.check_image_size(cfg.scale.image_size)
        data.check_splits(**cfg.splits)
    except ConfigError as error:
        lines.append(str(error))
    if lines:
        raise ConfigError(as_message(lines))


def warn_of_idle_settings(cfg: DictConfig) -> None:
    """Warn of settings of a valid config that have no effect in its combination."""
    for message in idle_settings(to_plain(cfg, "", Problems())):
        warnings.warn(message, stacklevel=2)


def _validate_against(
    schema: type, cfg: DictConfig, trusted_targets: Sequence[str], sections: Sequence[str] | None = None
) -> None:
    """Check the sections of a config, all if None; the others are neither read nor resolved."""
    check_values(OmegaConf.to_container(cfg, resolve=False))
    problems = Problems(trusted=tuple(trusted_targets))
    plain = to_plain(cfg, "", problems, names=sections)
    check_section(schema, plain, "", problems)
    if not {str(one) for one in plain.get("trusted_targets") or ()} <= set(trusted_targets):
        problems.add(
            "trusted_targets",
            f"found {shown(plain['trusted_targets'])} in a file, expected it on the command line.",
        )
    for keys, rule in RULES:
        values = [look_up(plain, key) for key in keys]
        if not any(value is BROKEN or problems.touch(key) for key, value in zip(keys, values, strict=True)):
            for key, message in rule(*values):
                problems.add(key, message)
    if problems.entries:
        raise ConfigError(as_message(problems.lines()))


def as_message(lines: Sequence[str]) -> str:
    """One message for a list of problems."""
    if len(lines) == 1:
        return lines[0]
    return "\n".join([f"The config has {counted(len(lines), 'problem')}:", *(f"  {line}" for line in lines)])


def to_plain(node: Any, key: str, problems: Problems, *, names: Sequence[Any] | None = None) -> Any:
    """Resolve a config, or some of its sections, into dicts, lists and values; what can not be read becomes a problem."""
    if isinstance(node, DictConfig):
        names = list(node.keys()) if names is None else [name for name in names if name in node]
    elif isinstance(node, ListConfig):
        names = range(len(node))
    else:
        return node
    values = {}
    for name in names:
        if OmegaConf.is_interpolation(node, name):
            raw = str(OmegaConf.to_container(node, resolve=False)[name])  # type: ignore[index]
            if match := INTERPOLATION.fullmatch(raw):
                problems.copies[join(key, name)] = match[1]
        try:
            missing = OmegaConf.is_missing(node, name)
            values[name] = MISSING if missing else to_plain(node[name], join(key, name), problems)
        except OmegaConfBaseException as error:
            first_line = str(error).splitlines()[0]
            problems.add(join(key, name), f"can not be read: {first_line}; correct what it refers to.")
            values[name] = BROKEN
    return list(values.values()) if isinstance(node, ListConfig) else values


def look_up(plain: Any, key: str) -> Any:
    """Value at a full key, BROKEN where there is none."""
    for name in key.split("."):
        if not isinstance(plain, Mapping) or name not in plain:
            return BROKEN
        plain = plain[name]
    return plain
