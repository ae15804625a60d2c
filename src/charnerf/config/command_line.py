"""The command line of a training: every job is checked before any starts, and an error is one message."""

import os
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from charnerf.config.composition import compose_unchecked
from charnerf.config.given_folders import (
    check_hydra,
    given_search_path,
    hydras_settings,
    typed_settings,
    with_search_path,
)
from charnerf.config.hydra_internals import looks_only, read_arguments
from charnerf.config.overrides import config_files, jobs_of, trusted_by
from charnerf.config.validation import check_files, validate, warn_of_idle_settings
from charnerf.errors import CharNeRFError, ConfigError
from charnerf.files import error_words
from charnerf.wording import counted, printable

FAILED, WRONG_CALL = 1, 2


def check_command_line(arguments: Sequence[str], *, conf: Path) -> None:
    """Compose and validate every job that a command line of `train.py` asks for.

    Raises:
        ConfigError: Lists what is wrong with the first job that has a problem, and how many others have.
    """
    args = read_arguments(arguments)
    name = (args.config_name or "train").removesuffix(".yaml")
    folder = Path(args.config_path).resolve() if args.config_path else conf
    given = given_search_path(args, name)
    if looks_only(args):
        return
    typed = typed_settings(args.overrides, conf) if given or args.config_path else None
    broken: list[tuple[list[str], ConfigError]] = []
    with config_files(folder):
        jobs = jobs_of(args.overrides) if args.multirun else [list(args.overrides)]
        for job in jobs:
            try:
                overrides = with_search_path(job, given)
                cfg = compose_unchecked(name, overrides)
                validate(cfg, trusted_targets=trusted_by(job))
                if typed is not None:
                    check_hydra(typed, hydras_settings(name, overrides))
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
        f"{len(broken)} of {counted(len(jobs), 'job')} can not start, so none was; first `{' '.join(first)}`:\n{problem}"
    ) from problem


def run_door(function: Callable[[], object], *, arguments: Sequence[str], conf: Path) -> int:
    """Run an entry point of Hydra: checks its command line first, and tells errors in one message.

    Returns:
        Exit status: 0 done, 1 failed, 2 wrong call.
    """
    before = os.environ.get("HYDRA_FULL_ERROR")
    debug = before == "1"
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
        sys.stderr.write(f"error: {kind}{printable(error_words(error))}{hint}\n")
        return (
            WRONG_CALL if isinstance(error, ConfigError | HydraException | OmegaConfBaseException) else FAILED
        )
    finally:
        if before is None:  # else the next call of the process would show tracebacks
            os.environ.pop("HYDRA_FULL_ERROR", None)
        else:
            os.environ["HYDRA_FULL_ERROR"] = before
    return 0
