"""What commands tell their user."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import typer

from charnerf.progress import reported_to

_is_quiet: ContextVar[bool] = ContextVar("is_quiet", default=False)


def say(text: str) -> None:
    """Tell the user, on standard error: standard output is for what programs read."""
    if not _is_quiet.get() or text.startswith("warning"):
        typer.echo(text, err=True)


@contextmanager
def quiet() -> Iterator[None]:
    """Tell nothing meanwhile but warnings; errors are told by whoever catches them."""
    token = _is_quiet.set(True)
    try:
        with reported_to(lambda moment: None):
            yield
    finally:
        _is_quiet.reset(token)
