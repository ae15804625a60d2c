"""The command `card`: options and help; registered by `charnerf.cli`."""

from pathlib import Path
from typing import Annotated

import typer


def card(
    file: Annotated[
        Path,
        typer.Argument(metavar="CARD", exists=True, dir_okay=False, help="Markdown with the marks in it."),
    ],
    *,
    curve: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="CSV",
            exists=True,
            dir_okay=False,
            help="curve.csv of a run that made the weights; several times, in order.",
        ),
    ] = None,
    measured: Annotated[
        list[str] | None,
        typer.Option(metavar="TITLE=FOLDER", help="What `charnerf evaluate -o` left; several times."),
    ] = None,
) -> None:
    """Write the training curve and the tables of evaluations into a model card, between its marks.

    The words around them stay; curve.png and the metrics are put beside the card.
    """
    from charnerf.cli.messages import say
    from charnerf.reporting.card import titled, write_card

    for written in write_card(file, curve or [], titled(measured or [])):
        say(str(written))
