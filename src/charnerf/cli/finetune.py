"""`charnerf finetune`: weights adapted to one character's drawings."""

from typing import Annotated

import typer

from charnerf.cli.drawings import GivenDrawings, drawings_options
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, Folder, Trusted, WeightsOption, gathered


@gathered(given=drawings_options)
def command(
    given: GivenDrawings,
    *,
    output: Folder,
    weights: WeightsOption = None,
    seconds: Annotated[
        float,
        typer.Option(
            min=1.0, help="Time for it, preparing included; it ends earlier where nothing improves."
        ),
    ] = 30.0,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Adapt weights to one character's drawings: DIR/weights.safetensors, curve and report.

    Only what follows the combination of the views learns. The weights are kept only if patches of the drawings
    that nothing was learnt from come out better and novel views stay near the start; else DIR gets the starting
    weights, and it is said. They are for this character alone: use them by `--weights DIR`.
    """
    from charnerf.finetuning.command import finetune_drawings

    model = load_model(weights, device=device, trust=trust)
    finetune_drawings(model, given.drawings, output=output, seconds=seconds, say=say)
