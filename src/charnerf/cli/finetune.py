"""`charnerf finetune`: weights adapted to one character's drawings."""

import shlex
import time
from typing import Annotated

import typer

from charnerf.cli.drawings import GivenDrawings, drawings_options
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, Folder, Trusted, WeightsOption, gathered
from charnerf.cli.summary import JsonFile, Summary, check_json, close
from charnerf.wording import counted

EXAMPLES = (
    "charnerf finetune front.png side.png back.png -o fitted",
    "charnerf finetune front.png side.png back.png -o fitted --seconds 60 --weights outputs/run",
)


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
    json_file: JsonFile = None,
) -> None:
    """Adapt weights to one character's drawings: DIR/weights.safetensors, curve and report.

    Only what follows the combination of the views learns. The weights are kept only if patches of the drawings
    that nothing was learnt from come out better and novel views stay near the start; else DIR gets the starting
    weights, and it is said. They are for this character alone: use them by `--weights DIR`.
    """
    from charnerf.finetuning.command import finetune_drawings

    began = time.perf_counter()
    check_json(json_file)
    model = load_model(weights, device=device, trust=trust)
    done = finetune_drawings(model, given.drawings, output=output, seconds=seconds, say=say)
    first, best = done.curve[0], done.best
    close(
        Summary(
            made=f"weights adapted by {counted(best.step, 'step')}"
            if done.kept
            else "the starting weights again",
            files=(output / "report.html", output / "weights.safetensors"),
            began=began,
            quality=f"held-out patches {first.held_out_psnr:.1f} dB before, {best.held_out_psnr:.1f} dB now. {done.reason}",
            next_=(f"charnerf reconstruct FRONT SIDE BACK {shlex.join(['--weights', str(output)])} -o DIR",),
            facts={"kept": done.kept, "steps": done.curve[-1].step, "held_out_psnr": best.held_out_psnr},
        ),
        json_file,
    )
