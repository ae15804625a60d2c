"""The commands about drawings, `draw` and `gallery`: options and help; registered by `charnerf.cli`."""

from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.options import Dataset, Device, Folder, Trusted, WeightsOption


def draw(
    *,
    data: Dataset,
    character: Annotated[
        list[str], typer.Option(metavar="NAME", help="Character of the data set; may be given several times.")
    ],
    output: Folder,
    size: Annotated[int, typer.Option(min=32, max=4096, help="Side of every drawing, pixels.")] = 512,
    seed: Annotated[int, typer.Option(min=0, help="Another seed is another artist.")] = 0,
) -> None:
    """Draw characters of a data set as somebody would: DIR/front.png, side.png, back.png; DIR/NAME/ for several.

    Ink, flat tones, paper, and the small contradictions of views drawn one by one: for trying `reconstruct` on
    drawings of a character whose shape is known.
    """
    from charnerf import commands

    commands.draw(data, character, output, size=size, seed=seed)


def gallery(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER...",
            exists=True,
            file_okay=False,
            help="Each holds pictures named front, side (or right) and back.",
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="PNG", dir_okay=False, help="Picture to write.")
    ],
    *,
    weights: WeightsOption = None,
    size: Annotated[int, typer.Option(min=32, max=1024, help="Side of every panel, pixels.")] = 160,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Reconstruct several characters into one picture: a row each, the drawings, then views from between them."""
    from charnerf import commands

    commands.gallery(folders, output, weights=weights, size=size, device=device, trust=trust or [])
