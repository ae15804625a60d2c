"""`charnerf watch`: a run or a grid while it trains."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.messages import say
from charnerf.cli.summary import JsonFile, Summary, check_json, close, show
from charnerf.errors import ConfigError, DataError
from charnerf.wording import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from charnerf.watching.state import State

EXAMPLES = (
    "charnerf watch outputs/run",
    "charnerf watch outputs/grid --once",
    "charnerf watch outputs --once --json -",
)


def command(
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="A run, or runs lie below it."),
    ],
    *,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the page; 0 is any that is free.")] = 6007,
    once: Annotated[bool, typer.Option("--once", help="Print how far the runs are, and leave.")] = False,
    json_file: JsonFile = None,
) -> None:
    """Show how far runs are: a page that refreshes itself, for this machine alone, until Ctrl-C; or with --once lines.

    Runs that train, ended, were killed or failed are told apart. From another machine: ssh -L 6007:localhost:6007 HOST.
    """
    from charnerf.watching.folder import WatchedFolder
    from charnerf.watching.server import WatchServer

    began = time.perf_counter()
    check_json(json_file)
    if json_file is not None and not once:
        raise ConfigError("--json: found without --once, expected both; a page is served until Ctrl-C.")
    watched = WatchedFolder(folder)
    if not once:
        try:
            server = WatchServer(watched, port)
        except OSError as error:
            raise DataError(
                f"--port {port}: {error.strerror}, expected a free one; --port 0 takes any."
            ) from error
        with server:
            say(f"{folder}: {server.address} (Ctrl-C ends)")
            server.serve_forever()
    states = [one.state for one in watched.watched()]
    show(_table(states), json_file)
    close(_summary(states, folder, began), json_file)


def _table(states: "Sequence[State]") -> str:
    """States in columns."""
    from charnerf.watching.page import HEADER, row

    rows = [HEADER, *map(row, states)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, one, widths)).rstrip() for one in rows)


def _summary(states: "Sequence[State]", folder: Path, began: float) -> Summary:
    from dataclasses import asdict

    from charnerf.watching.page import stages

    facts = {"runs": [asdict(state) for state in states]}
    return Summary(
        f"a look at {counted(len(states), 'run')}", (folder,), began, quality=stages(states), facts=facts
    )
