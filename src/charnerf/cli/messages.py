"""What commands tell their user."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import typer

from charnerf.progress import reported_to

_quiet: ContextVar[bool] = ContextVar("quiet", default=False)


def is_quiet() -> bool:
    """Whether the user asked for warnings and errors alone."""
    return _quiet.get()


def say(text: str) -> None:
    """Tell the user, on standard error: standard output is for what programs read."""
    if not is_quiet() or text.startswith("warning"):
        typer.echo(text, err=True)


@contextmanager
def quiet() -> Iterator[None]:
    """Tell nothing meanwhile but warnings; errors are told by whoever catches them."""
    token = _quiet.set(True)
    try:
        with reported_to(lambda moment: None):
            yield
    finally:
        _quiet.reset(token)
