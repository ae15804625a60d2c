"""`charnerf bench`: error against run time."""

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, SomeDataset, SplitName, Trusted, Weights
from charnerf.cli.summary import Summary, close

EXAMPLES = ("charnerf bench --quick", "charnerf bench outputs/run --data characters --json bench.json")


def command(
    weights: Weights = None,
    *,
    quick: Annotated[
        bool, typer.Option("--quick", help="Leave out the sweep of samples and tolerances.")
    ] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", dir_okay=False, help="Write all numbers there.")
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", file_okay=False, help="For the sweep's diagram.")
    ] = Path("outputs/bench"),
    data: SomeDataset = None,
    split: SplitName = "test",
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Measure error against run time: speed-ups over a pixelNeRF-like evaluation, and what they cost."""
    from charnerf.bench.run import run, summary
    from charnerf.files import write_text

    began = time.perf_counter()
    model = load_model(weights, device=device, trust=trust)
    result = run(model, data=data, split=split, quick=quick, output=output, say=say)
    if json_file is not None:
        write_text(json_file, json.dumps(result, indent=2) + "\n")
    typer.echo(summary(result))
    files = [*([] if quick else [output]), *([] if json_file is None else [json_file])]
    close(Summary(made="error against run time", files=files, began=began), None)
