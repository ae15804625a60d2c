"""`charnerf bench`: error against run time."""

import time
from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.dataset import GivenDataset
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, SomeDataset, SplitName, Trusted, Weights
from charnerf.cli.summary import JsonFile, Summary, check_json, close, show

EXAMPLES = ("charnerf bench --quick", "charnerf bench outputs/run --data characters --json bench.json")


def command(
    weights: Weights = None,
    *,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Leave out the sweep of samples and tolerances, and the levels of drawings."
        ),
    ] = False,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", file_okay=False, help="For the sweep's diagram.")
    ] = Path("outputs/bench"),
    data: SomeDataset = None,
    split: SplitName = "test",
    device: Device = "auto",
    trust: Trusted = None,
    json_file: JsonFile = None,
) -> None:
    """Measure error against run time: speed-ups over a pixelNeRF-like evaluation, and what they cost."""
    from charnerf.bench.run import run, summary
    from charnerf.files import check_folder

    began = time.perf_counter()
    check_json(json_file)
    check_folder(output)
    model = load_model(weights, device=device, trust=trust)
    root = None if data is None else GivenDataset(data, None).opened()
    result = run(model, data=root, split=split, quick=quick, output=output, say=say)
    show(summary(result), json_file)
    files = () if quick else (output,)
    close(Summary(made="error against run time", files=files, began=began, facts=result), json_file)
