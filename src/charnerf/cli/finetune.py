"""The command `finetune`: options and help; registered by `charnerf.cli`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from charnerf.cli.options import Device, Folder, Trusted, WeightsOption


def finetune(
    front: Annotated[
        Path, typer.Argument(metavar="FRONT", exists=True, dir_okay=False, help="Front view, an image.")
    ],
    side: Annotated[Path, typer.Argument(metavar="SIDE", exists=True, dir_okay=False, help="Side view.")],
    back: Annotated[Path, typer.Argument(metavar="BACK", exists=True, dir_okay=False, help="Back view.")],
    *,
    output: Folder,
    weights: WeightsOption = None,
    seconds: Annotated[
        float, typer.Option(min=1.0, help="Time for it; it ends earlier where nothing improves.")
    ] = 30.0,
    side_shows: Annotated[
        Literal["left", "right"],
        typer.Option(
            "--side",
            help="Which side of the character SIDE shows; left: its face looks to the picture's left.",
        ),
    ] = "left",
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Adapt weights to one character's drawings: DIR/weights.safetensors, curve and report.

    Only what follows the combination of the views learns. The weights are kept only if patches of the drawings
    that nothing was learnt from come out better and novel views stay near the start; else DIR gets the starting
    weights, and it is said. They are for this character alone: use them by `--weights DIR`.
    """
    from charnerf import commands

    commands.finetune(
        (front, side, back),
        output,
        weights=weights,
        seconds=seconds,
        side_is=side_shows,
        device=device,
        trust=trust or [],
    )
