"""`charnerf app`: a page to drop drawings on, served by this machine to its own browser."""

import asyncio
import functools
import webbrowser
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, Trusted, WeightsOption
from charnerf.errors import ConfigError, DependencyError

if TYPE_CHECKING:
    from charnerf.app.studio import Studio

EXAMPLES = (
    "charnerf app",
    "charnerf app --open --port 9000",
    "charnerf app --host 0.0.0.0 --name studio.example.org",
)
LOCAL = ("localhost", "127.0.0.1", "::1")

Host = Annotated[
    str, typer.Option(help="Address that it is served at; by default nobody but this machine reaches it.")
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free one.")]
Names = Annotated[
    list[str] | None,
    typer.Option("--name", metavar="HOST", help="A further name that the page is reached by; several times."),
]
Open = Annotated[bool, typer.Option("--open", help="Open the page in the browser.")]


def command(
    *,
    host: Host = LOCAL[1],
    port: Port = 8765,
    names: Names = None,
    weights: WeightsOption = None,
    device: Device = "auto",
    trust: Trusted = None,
    is_opened: Open = False,
) -> None:
    """Serve a page: drop drawings, see how they were read, make the character, turn it, take it away.

    Nothing leaves this machine. Characters are made one at a time, each in a process of its own; what was made is kept while its
    page is open, and half an hour longer.
    """
    try:
        import aiohttp  # noqa: F401
    except ImportError as error:
        raise DependencyError(
            f"charnerf app: aiohttp is missing ({error}). Install it by `pip install 'charnerf[app]'`."
        ) from error
    from charnerf.app.folder import temporary_folder
    from charnerf.app.studio import Studio, process_context

    load = functools.partial(load_model, weights, device=device, trust=trust)
    with temporary_folder() as folder:
        studio = Studio(folder, load, process_context())
        asyncio.run(
            _serve(
                studio, host, port, {*LOCAL, host.lower(), *(one.lower() for one in names or ())}, is_opened
            )
        )


async def _serve(studio: "Studio", host: str, port: int, names: set[str], is_opened: bool) -> None:
    """Serve until a signal ends it."""
    from charnerf.app.server import serving

    try:
        async with serving(studio, host, port, names) as (address, free):
            say("Loading the model ...")
            await studio.reader.ready()
            shown = host if host in LOCAL else address
            url = f"http://{f'[{shown}]' if ':' in shown else shown}:{free}/"
            say(f"{url}  (Ctrl-C ends it; nothing leaves this machine)")
            if host not in LOCAL:
                say("warning: whoever reaches this machine's address can use the page; nothing is encrypted.")
            if is_opened:
                webbrowser.open(url)
            await asyncio.Event().wait()
    except OSError as error:
        raise ConfigError(
            f"--host {host}, --port {port}: can not be served there ({error.strerror or error}). Try --port 0."
        ) from error
