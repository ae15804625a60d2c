"""The commands, and how they leave: exit status 0 done, 1 failed, 2 wrong call, 130 or 143 stopped; errors are one message.

A command's file imports what is heavy when the command runs, so that help and completion are instant.
"""

import sys
import traceback
from collections.abc import Sequence
from contextlib import nullcontext
from typing import Annotated

import typer

from charnerf.cli import (
    app,
    bench,
    capture,
    check,
    doctor,
    draw,
    env,
    evaluate,
    finetune,
    gallery,
    generate,
    mesh,
    pack,
    reconstruct,
    report,
    search,
    train,
    watch,
)
from charnerf.cli.messages import quiet, say
from charnerf.errors import CharNeRFError, ConfigError
from charnerf.files import error_words
from charnerf.interruption import Stopped, leave, listening
from charnerf.process import limit_spinning
from charnerf.wording import printable

FAILED, WRONG_CALL = 1, 2
DEBUG_NOTE = (
    "Exit status: 0 done, 1 failed, 2 wrong call. 130 stopped by Ctrl-C (SIGINT), 143 by SIGTERM, 129 by SIGHUP, as its"
    " terminal closed. --debug shows the traceback of an error, --quiet leaves out all but warnings and errors; both also after"
    " the command."
)


def _epilog(examples: Sequence[str]) -> str:
    """What stands below a command's options: lines to type, which stay as they are, and the statuses."""
    return "\b\nExamples:\n" + "".join(f"  {example}\n" for example in examples) + f"\n{DEBUG_NOTE}"


door = typer.Typer(
    name="charnerf",
    help="Turnaround drawings (front, side, back) to a radiance field, novel views and a mesh.",
    epilog=DEBUG_NOTE,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
door.command("train", context_settings=train.HYDRA_READS_ALL)(train.command)
for module in (
    reconstruct,
    app,
    finetune,
    gallery,
    mesh,
    evaluate,
    report,
    capture,
    generate,
    draw,
    pack,
    bench,
    check,
    doctor,
    search,
    watch,
    env,
):
    door.command(module.__name__.rpartition(".")[2], epilog=_epilog(module.EXAMPLES))(module.command)


@door.callback()
def _options(
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error; also after the command.")
    ] = False,
    is_quiet: Annotated[
        bool, typer.Option("--quiet", help="Say nothing but warnings and errors; also after the command.")
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Turnaround drawings (front, side, back) to a radiance field, novel views and a mesh."""


def main() -> None:
    """Run a command and leave with its exit status."""
    limit_spinning()
    leave(run(sys.argv[1:]))


def _taken(arguments: list[str], *flags: str) -> tuple[list[bool], list[str]]:
    """Which flags stand anywhere before a `--`, and the arguments without them; what comes after may be files of these names."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    options = arguments[:end]
    rest = [one for one in options if one not in flags]
    return [flag in options for flag in flags], [*rest, *arguments[end:]]


def run(arguments: list[str]) -> int:
    """Run a command line and return its exit status."""
    (debug, is_quiet), arguments = _taken(arguments, "--debug", "--quiet")
    if "--version" in arguments[:1]:
        from charnerf import __version__

        typer.echo(f"charnerf {__version__}")
        return 0
    try:
        with listening(), quiet() if is_quiet else nullcontext():
            door(
                arguments, prog_name="charnerf", obj=debug
            )  # leaves by SystemExit, also for wrong options (2)
    except Stopped as stop:
        say(str(stop))
        return stop.status
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else FAILED if leaving.code else 0
    except Exception as error:
        if debug:
            traceback.print_exc()
        is_ours = isinstance(error, CharNeRFError | OSError)
        kind = "" if is_ours else f"{type(error).__name__}: "
        hint = "" if is_ours or debug else " (--debug shows where)"
        typer.echo(f"error: {kind}{printable(error_words(error))}{hint}", err=True)
        return WRONG_CALL if isinstance(error, ConfigError) else FAILED
    return 0
