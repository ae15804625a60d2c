"""From a command line to composed configs; what Hydra refuses becomes one clear message, before any work."""

import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import ConfigCompositionException, HydraException, MissingConfigException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from charnerf.config.hints import nearest
from charnerf.config.hydra_internals import looks_only, read_arguments, split_sweep
from charnerf.config.options import conf_folder
from charnerf.config.validation import check_files, validate, warn_of_idle_settings
from charnerf.errors import CharNeRFError, ConfigError

FAILED, WRONG_CALL = 1, 2


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
    with _hydra(conf or conf_folder()):
        cfg = _compose(name, overrides)
    validate(cfg, trusted_targets=trusted_by(overrides))
    return cfg


def check_command_line(arguments: Sequence[str], *, conf: Path) -> None:
    """Compose and validate every job that a command line of `train.py` asks for.

    Raises:
        ConfigError: Lists what is wrong with the first job that has a problem, and how many others have.
    """
    args = read_arguments(arguments)
    if looks_only(args):
        return
    name = (args.config_name or "train").removesuffix(".yaml")
    folder = Path(args.config_path).resolve() if args.config_path else conf
    more = [f"hydra.searchpath=[{Path(args.config_dir).resolve().as_uri()}]"] if args.config_dir else []
    with _hydra(folder):
        jobs = _jobs(args.overrides) if args.multirun else [list(args.overrides)]
        broken: list[tuple[list[str], ConfigError]] = []
        for job in jobs:
            try:
                cfg = _compose(name, more + job)
                validate(cfg, trusted_targets=trusted_by(job))
                check_files(cfg)
                warn_of_idle_settings(cfg)
            except ConfigError as error:
                broken.append((job, error))
    if not broken:
        return
    first, problem = broken[0]
    if not args.multirun:
        raise problem
    raise ConfigError(
        f"{len(broken)} of {len(jobs)} jobs can not start, so none was; first `{' '.join(first)}`:\n{problem}"
    ) from problem


def trusted_by(overrides: Sequence[str]) -> list[str]:
    """Modules that `trusted_targets=[...]` names on a command line."""
    for override in parse_overrides(overrides):
        if override.key_or_group == "trusted_targets" and isinstance(override.value(), list):
            return [str(one) for one in override.value()]  # type: ignore[union-attr]
    return []


def run_door(function: Callable[[], object], *, arguments: Sequence[str], conf: Path) -> int:
    """Run an entry point of Hydra: checks its command line first, and tells errors in one message.

    Returns:
        Exit status: 0 done, 1 failed, 2 wrong call.
    """
    debug = os.environ.get("HYDRA_FULL_ERROR") == "1"
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra hands errors on instead of printing them
    try:
        check_command_line(arguments, conf=conf)
        function()
    except KeyboardInterrupt:
        sys.stderr.write("stopped.\n")
        return FAILED
    except Exception as error:
        if debug:
            traceback.print_exc()
        is_ours = isinstance(error, CharNeRFError | HydraException | OmegaConfBaseException | OSError)
        kind = "" if is_ours else f"{type(error).__name__}: "
        hint = "" if is_ours or debug else " (HYDRA_FULL_ERROR=1 shows where)"
        sys.stderr.write(f"error: {kind}{error}{hint}\n")
        return (
            WRONG_CALL if isinstance(error, ConfigError | HydraException | OmegaConfBaseException) else FAILED
        )
    return 0


@contextmanager
def _hydra(conf: Path) -> Iterator[None]:
    """Hydra's global state, set up for a folder of config files and cleared again."""
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf), version_base="1.3", job_name="train"):
        yield


def parse_overrides(overrides: Sequence[str]) -> list[Override]:
    """Read overrides; one that can not be read is named alone."""
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


def _jobs(overrides: Sequence[str]) -> list[list[str]]:
    """The overrides of every job of a sweep."""
    try:
        return split_sweep(parse_overrides(overrides))
    except HydraException as error:
        raise ConfigError(f"{' '.join(overrides)}: {error}") from error


def _compose(name: str, overrides: Sequence[str]) -> DictConfig:
    """Compose; a key that Hydra does not know is let in: `validate` names it beside all other problems."""
    accepted = []
    for one in parse_overrides(overrides):
        options = GlobalHydra.instance().config_loader().get_group_options(one.key_or_group)
        if options and not one.is_delete() and not isinstance(one.value(), str | list | None):
            raise ConfigError(_no_option(one.key_or_group, str(one.value()), options))
        accepted.append(one.input_line or "")
    for _ in range(len(accepted) + 1):
        try:
            return compose(name, overrides=accepted)
        except MissingConfigException as error:
            raise ConfigError(_about_missing_option(error)) from error
        except ConfigCompositionException as error:
            unknown = re.match(r"Could not override '([^']+)'", str(error))
            index = next(
                (i for i, one in enumerate(accepted) if unknown and one.startswith(f"{unknown[1]}=")), None
            )
            if index is None or unknown is None or unknown[1].startswith("hydra."):
                raise ConfigError(_about_composition(error)) from error
            if "/" in unknown[1]:
                groups = GlobalHydra.instance().config_loader().list_groups("")
                raise ConfigError(f"{unknown[1]}: unknown group; {nearest(unknown[1], groups)}") from error
            accepted[index] = f"++{accepted[index]}"
        except (HydraException, OmegaConfBaseException) as error:
            raise ConfigError(_about_composition(error)) from error
    raise ConfigError(f"{' '.join(overrides)}: can not be composed; check each key=value.")


def _about_missing_option(error: MissingConfigException) -> str:
    group, _, option = (error.missing_cfg_file or "").rpartition("/")
    if not group:
        return (
            f"--config-name: found no file {error.missing_cfg_file}.yaml among the config files; leave it out"
            " for `train`."
        )
    options = list(error.options or GlobalHydra.instance().config_loader().get_group_options(group))
    return _no_option(group, option, options)


def _no_option(group: str, option: str, options: Sequence[str]) -> str:
    close = nearest(option, options)
    also = f" D{close[1:]}" if close.startswith("did") else ""
    return f"{group}: found no option '{option}', expected one of: {', '.join(sorted(options))}.{also}"


def _about_composition(error: BaseException) -> str:
    lines = [line for line in str(error).splitlines() if line.strip()]
    if error.__cause__ is not None:
        lines += str(error.__cause__).splitlines()[:1]
    return " ".join(lines[:3])
