"""`charnerf draw`: drawings of characters whose shape is known."""

import time
from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.completion import characters
from charnerf.cli.dataset import GivenDataset, dataset_options
from charnerf.cli.options import Folder, gathered
from charnerf.cli.summary import JsonFile, Summary, check_json, close, typed
from charnerf.wording import counted

EXAMPLES = ("charnerf draw --data characters --character anna -o drawings --level 2",)


@gathered(data=dataset_options)
def command(
    *,
    data: GivenDataset,
    character: Annotated[
        list[str],
        typer.Option(
            metavar="NAME",
            autocompletion=characters,
            help="Character of the data set; may be given several times.",
        ),
    ],
    output: Folder,
    size: Annotated[int, typer.Option(min=32, max=4096, help="Side of every drawing, pixels.")] = 512,
    seed: Annotated[int, typer.Option(min=0, help="Another seed is another artist.")] = 0,
    level: Annotated[
        int,
        typer.Option(
            min=0,
            max=3,
            help="How far views disagree: 0 as captured, 1 in place and size, 2 limbs off by 10 degrees, 3 by 30 degrees.",
        ),
    ] = 1,
    json_file: JsonFile = None,
) -> None:
    """Draw characters of a data set as somebody would: DIR/front.png, side.png, back.png; DIR/NAME/ for several.

    Ink, flat tones, paper, and the small contradictions of views drawn one by one: for trying `reconstruct` on
    drawings of a character whose shape is known.
    """
    from charnerf.data.characters import load_character
    from charnerf.drawings.artist import draw_character, write_drawings
    from charnerf.files import check_folder

    began = time.perf_counter()
    check_json(json_file)
    check_folder(output)
    root = data.opened()
    drawn = [load_character(root, name) for name in character]
    files: list[Path] = []
    for one in drawn:
        folder = output / one.name if len(drawn) > 1 else output
        files += write_drawings(draw_character(one, size=size, seed=seed, level=level), folder)
    next_ = (typed("reconstruct", *files[:3], "-o", "hero"),)
    close(Summary(made=counted(len(files), "drawing"), files=files, began=began, next_=next_), json_file)
