"""`charnerf capture`: meshes to a data set."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from charnerf.cli.messages import say
from charnerf.cli.options import Depth, Jobs, NewDataset, Size, Sources, Views
from charnerf.cli.summary import JsonFile, Summary, check_json, close, typed
from charnerf.errors import ConfigError, DataError
from charnerf.wording import counted

if TYPE_CHECKING:
    from charnerf.capture.dataset import CaptureReport
    from charnerf.capture.lights import AbstractLight
    from charnerf.capture.renderers.base import AbstractRenderer

EXAMPLES = (
    "charnerf capture meshes/ -o characters --split train",
    "charnerf capture anna.glb -o characters --split val --views 24",
    "charnerf capture meshes/ -o more --split train --variants 4 --swaps 2",
    "charnerf capture hero.fbx -o characters --renderer blender --pose Walk:12",
)

Meshes = Annotated[
    list[Path],
    typer.Argument(
        metavar="MESH...",
        exists=True,
        help="GLB, glTF, VRM, OBJ, PLY, STL files, by Blender FBX, .blend, DAE; or folders of them.",
    ),
]
Split = Annotated[str, typer.Option(metavar="NAME", help="Split that gets all given characters.")]
Up = Annotated[
    Literal["y", "z"] | None,
    typer.Option(
        help="Up axis of the files. Default: y for GLB, glTF, VRM, OBJ, FBX, DAE; z for PLY, STL, .blend."
    ),
]
Facing = Annotated[
    Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None,
    typer.Option(
        help="Axis that the characters face. Default: +z for GLB, glTF, OBJ, FBX, DAE; -y for PLY, STL, .blend."
    ),
]
Light = Annotated[Literal["unlit", "headlight"], typer.Option(help="Texture colours as they are, or shaded.")]
Renderer = Annotated[
    Literal["builtin", "blender"],
    typer.Option(
        help="What reads the files and takes the pictures; Blender needs charnerf[blender], or `blender`."
    ),
]
Engine = Annotated[Literal["cycles", "eevee"], typer.Option(help="Of Blender. Eevee is slow without a GPU.")]
Samples = Annotated[int, typer.Option(min=1, help="Of Blender, a pixel.")]
Pose = Annotated[
    str,
    typer.Option(
        metavar="rest|ACTION:FRAME", help="Of Blender: the rest pose, or an action of the file at a frame."
    ),
]
Objects = Annotated[
    list[str] | None,
    typer.Option(
        "--object",
        metavar="NAME",
        help="Of Blender: the object or collection that is the character, with what hangs on it; may be repeated.",
    ),
]
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
Dressed = Annotated[
    int,
    typer.Option(
        min=0,
        help="Capture so many variants of each mesh that wear hats, hair, plates, packs and skirts of any shape: NAME+w1, ...",
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
Seed = Annotated[
    int, typer.Option(min=0, help="The same seed gives the same variants, swaps, clothes and drawings.")
]


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
    dressed: Dressed = 0,
    drawn: Drawn = 0,
    seed: Seed = 0,
    renderer: Renderer = "builtin",
    engine: Engine = "cycles",
    samples: Samples = 64,
    pose: Pose = "rest",
    objects: Objects = None,
    jobs: Jobs = None,
    json_file: JsonFile = None,
) -> None:
    """Turn meshes into a data set: pictures from all around, source views, cameras, surface.

    Every character is brought to 2 m height with its feet on the floor; its name is its file's stem, and one that is in the data
    set already is refused. Exit status 1 if a mesh could not be captured; others are. The same command goes on when interrupted.
    """
    from charnerf.capture.character import CaptureOptions
    from charnerf.capture.dataset import capture_dataset
    from charnerf.drawings.redrawn import with_drawn_sources

    began = time.perf_counter()
    check_json(json_file)
    eye = _renderer(renderer, engine=engine, samples=samples, pose=pose, objects=tuple(objects or ()))
    copies = {"variants": variants, "swaps": swaps, "dressed": dressed, "drawn": drawn, "seed": seed}
    done = capture_dataset(
        meshes,
        output,
        split,
        options=CaptureOptions(views, size, sources, depth, _light(light), eye),
        **copies,
        draw=with_drawn_sources if drawn else None,
        processes=jobs,
        up=up,
        facing=facing,
    )
    _report(done, output, split, began, json_file)


def _light(name: str) -> "AbstractLight":
    from charnerf.capture.lights import Headlight, Unlit

    return Unlit() if name == "unlit" else Headlight()


def _renderer(
    name: str, *, engine: Literal["cycles", "eevee"], samples: int, pose: str, objects: tuple[str, ...]
) -> "AbstractRenderer":
    """The renderer, with the options that are its own.

    Raises:
        ConfigError: If others were given.
    """
    from charnerf.capture.renderers.blender import Blender
    from charnerf.capture.renderers.built_in import BuiltIn

    blender = Blender(engine=engine, samples=samples, pose=pose, objects=objects)
    if name == "blender":
        return blender
    if blender != Blender():
        raise ConfigError("--engine, --samples, --pose and --object are Blender's; add --renderer blender.")
    return BuiltIn()


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
        "notes": done.notes,
        "characters_a_second": done.characters_a_second,
        "split": split,
        "digest": digest,
    }
    made = f"{counted(len(done.captured), 'character')} captured into split {split}"
    made += f" ({done.characters_a_second:.3g} a second)" if done.captured else ""
    made += "" if digest is None else f", whose digest is {digest} wherever its data are the same"
    close(Summary(made=made, files=(output,), began=began, next_=next_, facts=facts), json_file)
    if done.failed:
        raise DataError(
            f"{counted(len(done.failed), 'mesh', 'meshes')} could not be captured:\n  "
            + "\n  ".join(done.failed)
        )
