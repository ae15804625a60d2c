"""`charnerf gallery`: the reconstructions of several folders of drawings in one picture."""

import time
from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.model import load_model
from charnerf.cli.options import Device, Trusted, WeightsOption
from charnerf.cli.summary import JsonFile, Summary, check_json, close
from charnerf.wording import counted

EXAMPLES = ("charnerf gallery anna/ robot/ -o gallery.png",)


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
    json_file: JsonFile = None,
) -> None:
    """Reconstruct several characters into one picture: a row each, the drawings, then views from between them."""
    from charnerf.files import check_folder
    from charnerf.reconstruction.gallery import write_gallery

    began = time.perf_counter()
    check_json(json_file)
    check_folder(output.parent)
    model = load_model(weights, device=device, trust=trust)
    file = write_gallery(model, folders, output, size=size)
    close(
        Summary(made=f"a picture of {counted(len(folders), 'character')}", files=(file,), began=began),
        json_file,
    )
