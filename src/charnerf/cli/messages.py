"""What commands tell their user."""

import typer


def say(text: str) -> None:
    """Tell the user, on standard error: standard output is for what programs read."""
    typer.echo(text, err=True)
