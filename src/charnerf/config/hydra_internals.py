"""What charnerf takes from Hydra's private modules; no other file imports them.

Known to work with hydra-core 1.3.4 to 1.3.8; pyproject.toml holds it below 1.4.
"""

from argparse import Namespace
from collections.abc import Sequence

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.types import Override

_LOOKS_ONLY = ("help", "hydra_help", "version", "cfg", "info", "shell_completion")


def read_arguments(arguments: Sequence[str]) -> Namespace:
    """Read a command line: overrides, wherever they stand, multirun, config_name, config_path, config_dir and others."""
    return get_args_parser().parse_intermixed_args(list(arguments))


def options_first(arguments: Sequence[str]) -> list[str]:
    """A command line as `hydra.main` reads it, which refuses overrides on both sides of an option; help is left as typed."""
    read = read_arguments(arguments)
    if looks_only(read):
        return list(arguments)
    options = list(arguments)
    for override in read.overrides:
        options.remove(override)
    return [*options, *read.overrides]


def looks_only(arguments: Namespace) -> bool:
    """Whether a command line asks for help or a composed config, and runs nothing."""
    return any(getattr(arguments, name, None) for name in _LOOKS_ONLY)


def split_sweep(overrides: list[Override]) -> list[list[str]]:
    """The overrides of every job of a sweep, as Hydra's own sweeper splits them."""
    return [job for batch in BasicSweeper.split_arguments(overrides, max_batch_size=None) for job in batch]
