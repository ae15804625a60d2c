"""What a grid is: the folder that a sweep's command line means, and when two configs are the same."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import ChoiceSweep, Override
from omegaconf import DictConfig, OmegaConf

from charnerf.config.hydra_internals import looks_only, options_first, read_arguments
from charnerf.config.overrides import parse_overrides
from charnerf.config.schema import LIST_GROUPS

GRIDS = Path("outputs/grid")
SETTABLE = (
    "hydra.sweep.dir",
    "hydra.job.config.override_dirname.exclude_keys",
    "hydra.launcher.submitit_folder",
)
NOT_OF_A_CELL = ("ckpt_path",)  # where a run begins, not what it is


@dataclass(frozen=True)
class GridCommand:
    """A sweep's command line, made to mean the same folders whenever it is typed.

    Attributes:
        arguments: The command line with the grid's folder, and names of cells made of the swept keys alone.
        folder: The grid's folder.
    """

    arguments: list[str]
    folder: Path


def grid_command(arguments: Sequence[str]) -> GridCommand | None:
    """Find the grid that a command line of `train.py` asks for.

    The folder is `hydra.sweep.dir` where that is given, else `outputs/grid/<swept keys>-<hash>`, the hash being of all
    overrides but Hydra's own: the order of arguments, the order of swept values and the launcher change nothing.

    Args:
        arguments: As typed, without the program.

    Returns:
        None where no grid is trained: without -m, or where only help or a config is shown.

    Raises:
        ConfigError: If an override can not be read.
    """
    args = read_arguments(arguments)
    if not args.multirun or looks_only(args):
        return None
    parsed = {one.key_or_group: one for one in parse_overrides(args.overrides)}
    own = {key: one for key, one in parsed.items() if key.split(".")[0].split("/")[0] != "hydra"}
    swept = [key for key, one in own.items() if one.is_sweep_override()]
    more = []
    if SETTABLE[0] in parsed:
        folder = Path(str(parsed[SETTABLE[0]].value()))
    else:
        text = "\n".join(sorted(map(_without_order, own.values())))
        folder = GRIDS / f"{'+'.join(sorted(swept)) or 'one'}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
        more.append(f"{SETTABLE[0]}='{folder.as_posix()}'")
    if swept and SETTABLE[1] not in parsed:
        fixed = ",".join(f"'{key}'" for key in own if key not in swept)
        more.append(f"{SETTABLE[1]}=[{fixed}]")
    launcher = parsed.get("hydra/launcher")
    if launcher is not None and str(launcher.value()).startswith("submitit") and SETTABLE[2] not in parsed:
        more.append(
            f"{SETTABLE[2]}='{(folder / '.submitit').as_posix()}'"
        )  # its own holds a %j that nobody fills in
    return GridCommand([*options_first(arguments), *more], folder)


def _without_order(override: Override) -> str:
    """An override's text, the values that it sweeps over sorted."""
    if not isinstance(override.value(), ChoiceSweep):  # a glob or a range has no order of its own
        return override.input_line or ""
    return f"{override.get_key_element()}={','.join(sorted(override.sweep_string_iterator()))}"


def config_hash(cfg: DictConfig) -> str:
    """Name a composed config by what it says, 8 hexadecimal digits; where a run begins does not count."""
    plain: Any = OmegaConf.to_container(cfg, resolve=True)
    kept = {
        key: list(value.items()) if key in LIST_GROUPS else value
        for key, value in plain.items()
        if key not in NOT_OF_A_CELL
    }
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()[:8]
