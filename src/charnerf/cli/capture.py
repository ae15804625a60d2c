"""`charnerf capture`: meshes to a data set."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from charnerf.cli.messages import say
from charnerf.cli.options import Depth, Jobs, NewDataset, Size, Sources, Views
from charnerf.cli.summary import JsonFile, Summary, check_json, close, typed
from charnerf.errors import DataError
from charnerf.wording import counted

if TYPE_CHECKING:
    from charnerf.capture.dataset import CaptureReport

EXAMPLES = (
    "charnerf capture meshes/ -o characters --split train",
    "charnerf capture anna.glb -o characters --split val --views 24",
    "charnerf capture meshes/ -o more --split train --variants 4 --swaps 2",
)

Meshes = Annotated[
    list[Path],
    typer.Argument(
        metavar="MESH...", exists=True, help="GLB, glTF, OBJ, PLY, STL files, or folders of them."
    ),
]
Split = Annotated[str, typer.Option(metavar="NAME", help="Split that gets all given characters.")]
Up = Annotated[
    Literal["y", "z"] | None,
    typer.Option(help="Up axis of the files. Default: y for GLB, glTF, OBJ; z for PLY, STL."),
]
Facing = Annotated[
    Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None,
    typer.Option(help="Axis that the characters face. Default: +z for GLB, glTF, OBJ; -y for PLY, STL."),
]
Light = Annotated[Literal["unlit", "headlight"], typer.Option(help="Texture colours as they are, or shaded.")]
Variants = Annotated[
    int,
    typer.Option(
        min=0,
        help="Capture so many variants of each mesh instead of it: other proportions, other poses, NAME+1, NAME+2, ...",
    ),
]
Swaps = Annotated[
    int,
    typer.Option(
        min=0,
        help="Capture so many characters with each mesh's body and other given meshes' heads and legs: NAME+s1, ...",
    ),
]
Drawn = Annotated[
    int,
    typer.Option(
        min=0,
        help="Capture so many copies of each mesh whose source views are drawings that disagree, for training, instead of"
        " it: NAME+d1, ...",
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="The same seed gives the same variants, swaps and drawings.")]


def command(
    meshes: Meshes,
    output: NewDataset,
    *,
    split: Split = "train",
    views: Views = 48,
    size: Size = 128,
    up: Up = None,
    facing: Facing = None,
    sources: Sources = "orthographic",
    light: Light = "unlit",
    depth: Depth = False,
    variants: Variants = 0,
    swaps: Swaps = 0,
    drawn: Drawn = 0,
    seed: Seed = 0,
    jobs: Jobs = None,
    json_file: JsonFile = None,
) -> None:
    """Turn meshes into a data set: pictures from all around, source views, cameras, surface.

    Every character is brought to 2 m height with its feet on the floor; its name is its file's stem, and one
    that is in the data set already is refused. Exit status 1 if a mesh could not be captured; the others are. The
    same command goes on with a capture that was interrupted.
    """
    from charnerf.capture.character import CaptureOptions
    from charnerf.capture.dataset import capture_dataset
    from charnerf.capture.lights import Headlight, Unlit
    from charnerf.drawings.redrawn import with_drawn_sources

    began = time.perf_counter()
    check_json(json_file)
    shown = Unlit() if light == "unlit" else Headlight()
    done = capture_dataset(
        meshes,
        output,
        split,
        options=CaptureOptions(views=views, size=size, sources=sources, depth=depth, light=shown),
        variants=variants,
        swaps=swaps,
        drawn=drawn,
        draw=with_drawn_sources if drawn else None,
        seed=seed,
        processes=jobs,
        up=up,
        facing=facing,
    )
    _report(done, output, split, began, json_file)


def _report(done: "CaptureReport", output: Path, split: str, began: float, json_file: Path | None) -> None:
    """Say what was captured, and fail where something was not."""
    from charnerf.data.digest import split_digest

    if done.skipped:
        say(
            f"{counted(len(done.skipped), 'character')} skipped: there from the same capture, which was interrupted."
        )
    names = [*done.captured, *done.skipped]
    digest = split_digest(output, split) if names else None
    next_ = [typed("mesh", "--data", output, "--character", names[0], "-o", "meshes")] if names else []
    next_ += [typed("train", "data=folder", f"data.root={output}")] if split == "train" and names else []
    facts = {
        "captured": done.captured,
        "skipped": done.skipped,
        "failed": done.failed,
        "split": split,
        "digest": digest,
    }
    made = f"{counted(len(done.captured), 'character')} captured into split {split}"
    made += "" if digest is None else f", whose digest is {digest} wherever its data are the same"
    close(Summary(made=made, files=(output,), began=began, next_=next_, facts=facts), json_file)
    if done.failed:
        raise DataError(
            f"{counted(len(done.failed), 'mesh', 'meshes')} could not be captured:\n  "
            + "\n  ".join(done.failed)
        )
