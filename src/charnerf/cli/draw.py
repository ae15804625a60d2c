"""`charnerf draw`: drawings of characters whose shape is known."""

from typing import Annotated

import typer

from charnerf.cli.dataset import GivenDataset, dataset_options
from charnerf.cli.messages import say
from charnerf.cli.options import Folder, gathered


@gathered(data=dataset_options)
def command(
    *,
    data: GivenDataset,
    character: Annotated[
        list[str], typer.Option(metavar="NAME", help="Character of the data set; may be given several times.")
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
) -> None:
    """Draw characters of a data set as somebody would: DIR/front.png, side.png, back.png; DIR/NAME/ for several.

    Ink, flat tones, paper, and the small contradictions of views drawn one by one: for trying `reconstruct` on
    drawings of a character whose shape is known.
    """
    from charnerf.data.characters import load_character
    from charnerf.drawings.artist import draw_character, write_drawings
    from charnerf.files import check_folder

    check_folder(output)
    root = data.opened()
    drawn = [load_character(root, name) for name in character]
    for one in drawn:
        folder = output / one.name if len(drawn) > 1 else output
        files = write_drawings(draw_character(one, size=size, seed=seed, level=level), folder)
        say(", ".join(str(file) for file in files))
