"""`charnerf gallery`: the reconstructions of several folders of drawings in one picture."""

from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, Trusted, WeightsOption


def command(
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
    from charnerf.files import check_folder
    from charnerf.reconstruction.gallery import write_gallery

    check_folder(output.parent)
    model = load_model(weights, device=device, trust=trust)
    say(f"gallery: {write_gallery(model, folders, output, size=size)}")
