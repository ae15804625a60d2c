"""The command `charnerf`: options and help here, the work in `charnerf.commands`, imported when one runs.

Exit status: 0 done, 1 failed, 2 wrong call. Errors are one message; `--debug` anywhere shows the traceback.
"""

import sys
import traceback
from pathlib import Path
from typing import Annotated, Literal

import typer

from charnerf.cli import drawings as cli_drawings
from charnerf.cli import mesh, reconstruct
from charnerf.cli.card import card
from charnerf.cli.finetune import finetune
from charnerf.cli.options import (
    Dataset,
    Depth,
    Device,
    Jobs,
    NearestFrom,
    NewDataset,
    Size,
    Sources,
    Trusted,
    Views,
    Weights,
)
from charnerf.errors import CharNeRFError, ConfigError
from charnerf.process import limit_spinning

FAILED, WRONG_CALL = 1, 2
DEBUG_NOTE = "Exit status: 0 done, 1 failed, 2 wrong call. --debug shows the traceback of an error."

app = typer.Typer(
    name="charnerf",
    help="Turnaround drawings (front, side, back) to a radiance field, novel views and a mesh.",
    epilog=DEBUG_NOTE,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback()
def _options(
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error; also after the command.")
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Turnaround drawings (front, side, back) to a radiance field, novel views and a mesh."""


@app.command(epilog=DEBUG_NOTE)
def capture(
    meshes: Annotated[
        list[Path],
        typer.Argument(
            metavar="MESH...", exists=True, help="GLB, glTF, OBJ, PLY, STL files, or folders of them."
        ),
    ],
    output: NewDataset,
    *,
    split: Annotated[
        str, typer.Option(metavar="NAME", help="Split that gets all given characters.")
    ] = "train",
    views: Views = 48,
    size: Size = 128,
    up: Annotated[
        Literal["y", "z"] | None,
        typer.Option(help="Up axis of the files. Default: y for GLB, glTF, OBJ; z for PLY, STL."),
    ] = None,
    facing: Annotated[
        Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None,
        typer.Option(help="Axis that the characters face. Default: +z for GLB, glTF, OBJ; -y for PLY, STL."),
    ] = None,
    sources: Sources = "orthographic",
    light: Annotated[
        Literal["unlit", "headlight"], typer.Option(help="Texture colours as they are, or shaded.")
    ] = "unlit",
    depth: Depth = False,
    variants: Annotated[
        int,
        typer.Option(
            min=0,
            help="Capture so many variants of each mesh instead of it: other proportions, other poses, NAME+1, NAME+2, ...",
        ),
    ] = 0,
    swaps: Annotated[
        int,
        typer.Option(
            min=0,
            help="Capture so many characters with each mesh's body and other given meshes' heads and legs: NAME+s1, ...",
        ),
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same variants and swaps.")] = 0,
    jobs: Jobs = None,
) -> None:
    """Turn meshes into a data set: pictures from all around, source views, cameras, surface.

    Every character is brought to 2 m height with its feet on the floor; its name is its file's stem, and one
    that is in the data set already is refused. Exit status 1 if a mesh could not be captured; the others are.
    """
    from charnerf import commands

    commands.capture(
        meshes,
        output,
        split=split,
        views=views,
        size=size,
        up=up,
        facing=facing,
        sources=sources,
        light=light,
        depth=depth,
        variants=variants,
        swaps=swaps,
        seed=seed,
        jobs=jobs,
    )


@app.command(epilog=DEBUG_NOTE)
def generate(
    output: NewDataset,
    *,
    train: Annotated[int, typer.Option(min=0, help="Characters of the train split.")] = 32,
    val: Annotated[int, typer.Option(min=0, help="Characters of the val split.")] = 4,
    test: Annotated[int, typer.Option(min=0, help="Characters of the test split.")] = 6,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same characters.")] = 0,
    views: Views = 48,
    size: Size = 128,
    jobs: Jobs = None,
) -> None:
    """Write the embedded characters of `data=procedural` as a data set."""
    from charnerf import commands

    commands.generate(output, train=train, val=val, test=test, seed=seed, views=views, size=size, jobs=jobs)


@app.command(epilog=DEBUG_NOTE)
def evaluate(
    *,
    data: Dataset,
    weights: Weights = None,
    split: Annotated[str, typer.Option(metavar="NAME", help="Split to measure on.")] = "test",
    views: Annotated[
        str | None,
        typer.Option(metavar="N|all", help="Fixed views a character; as many as in training if left out."),
    ] = None,
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", dir_okay=False, help="Write the metrics there as well."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="DIR", file_okay=False, help="Keep predictions and a report there."
        ),
    ] = None,
    renderer: Annotated[
        Literal["culled", "dense", "adaptive"] | None,
        typer.Option(help="Another renderer than the model was trained with."),
    ] = None,
    mesh: Annotated[bool, typer.Option(help="Make every mesh, for Chamfer and F-score.")] = True,
    resolution: Annotated[
        int, typer.Option(min=16, max=1024, help="Grid points along a mesh's longest side.")
    ] = 128,
    baselines: Annotated[
        bool, typer.Option(help="Measure white, the visual hull and the nearest beside the model.")
    ] = True,
    nearest_from: NearestFrom = None,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Measure a model on a split: PSNR, SSIM, LPIPS, FLIP, IoU, Chamfer, F-score, by angle, with seconds.

    Prints metrics.json.
    """
    from charnerf import commands

    commands.evaluate(
        weights,
        data,
        split=split,
        views=views,
        json_file=json_file,
        output=output,
        renderer=renderer,
        resolution=resolution if mesh else None,
        baselines=baselines,
        nearest_from=nearest_from or [],
        device=device,
        trust=trust or [],
    )


app.command(epilog=DEBUG_NOTE)(card)
app.command(epilog=DEBUG_NOTE)(cli_drawings.draw)
app.command(epilog=DEBUG_NOTE)(cli_drawings.gallery)
app.command("mesh", epilog=DEBUG_NOTE)(mesh.command)
app.command("reconstruct", epilog=DEBUG_NOTE)(reconstruct.command)
app.command(epilog=DEBUG_NOTE)(finetune)


@app.command(epilog=DEBUG_NOTE)
def report(
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="A run, or runs lie below it."),
    ],
    *,
    drawings: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            exists=True,
            file_okay=False,
            help="Show these drawings in every row: NAME/front.png, side.png, back.png, or pictures of fronts.",
        ),
    ] = None,
    trust: Trusted = None,
) -> None:
    """Write FOLDER/report.md and FOLDER/report.html: of a run, or over all runs below a folder.

    Runs that differ in their seed alone are one row. Interactive diagrams need plotly (the extra `report`).
    """
    from charnerf import commands

    commands.report(folder, drawings=drawings, trust=trust or [])


@app.command(epilog=DEBUG_NOTE)
def check(
    weights: Annotated[
        str | None,
        typer.Argument(
            metavar="[RUN_OR_WEIGHTS]",
            help="A run folder, a .ckpt, a .safetensors, or `released`: its field is checked too.",
        ),
    ] = None,
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", file_okay=False, help="For check.json and check.png."),
    ] = Path("outputs/check"),
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            metavar="DATASET",
            exists=True,
            file_okay=False,
            help="Data set of the character that the field is checked with; an embedded one if left out.",
        ),
    ] = None,
    character: Annotated[
        str | None, typer.Option("--character", metavar="NAME", help="Its name; the first one if left out.")
    ] = None,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Measure every numerical kernel, and a trained field, on stiff and extreme cases.

    Each row compares with a reference of higher precision and has a bound; the usual formulas stand beside
    and have to fail. Exit status 1 if any bound is broken.
    """
    from charnerf import commands

    if not commands.check(weights, output, data=data, character=character, device=device, trust=trust or []):
        raise typer.Exit(FAILED)


@app.command(epilog=DEBUG_NOTE)
def bench(
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
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            metavar="DATASET",
            exists=True,
            file_okay=False,
            help="Data set of the characters; embedded ones if left out.",
        ),
    ] = None,
    split: Annotated[str, typer.Option(metavar="NAME", help="Split of the data set.")] = "test",
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Measure error against run time: speed-ups over a pixelNeRF-like evaluation, and what they cost."""
    from charnerf import commands

    commands.bench(weights, data, split, quick, json_file, output, device=device, trust=trust or [])


def main() -> None:
    """Run a command and leave with its exit status."""
    limit_spinning()
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run a command line and return its exit status."""
    debug = "--debug" in arguments
    arguments = [one for one in arguments if one != "--debug"]
    if "--version" in arguments[:1]:
        from charnerf import __version__

        print(f"charnerf {__version__}")
        return 0
    try:
        app(arguments)  # leaves by SystemExit, also for wrong options (2) and Ctrl-C (1)
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else FAILED if leaving.code else 0
    except (CharNeRFError, OSError, MemoryError) as error:
        if debug:
            traceback.print_exc()
        print(f"error: {error}", file=sys.stderr)
        return WRONG_CALL if isinstance(error, ConfigError) else FAILED
    return 0
