"""`charnerf reconstruct`: drawings or a sheet to a mesh, a turntable, views and a report."""

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.drawings import GivenDrawings, drawings_options, reading_options
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import (
    Colors,
    Device,
    Folder,
    Size,
    Symmetric,
    Trusted,
    WeightsOption,
    gathered,
    mesh_options,
)
from charnerf.cli.summary import JsonFile, Summary, check_json, close
from charnerf.drawings.options import ReadingOptions
from charnerf.errors import ConfigError
from charnerf.meshing.options import MeshOptions
from charnerf.reconstruction.options import LIGHT, ReconstructionOptions
from charnerf.wording import counted

if TYPE_CHECKING:
    from charnerf.reconstruction.folder import Reconstruction

EXAMPLES = (
    "charnerf reconstruct front.png side.png back.png -o hero",
    "charnerf reconstruct sheet.png -o hero --order front,side,back",
    "charnerf reconstruct front.png side.png --view 45=quarter.png -o hero --refine 30 --symmetric",
)

BakedFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        dir_okay=False,
        help="Write the baked character there (.safetensors); charnerf.load_baked looks at it without the network.",
    ),
]


@gathered(given=drawings_options, reading=reading_options, mesh=mesh_options(LIGHT))
def command(
    given: GivenDrawings,
    *,
    output: Folder,
    reading: ReadingOptions,
    weights: WeightsOption = None,
    mesh: MeshOptions,
    faces: Annotated[int | None, typer.Option(help="Faces of the mesh after decimation.")] = LIGHT.faces,
    texture: Colors = LIGHT.texture,
    symmetric: Symmetric = ReconstructionOptions.symmetric,
    frames: Annotated[
        int, typer.Option(min=1, help="Frames of the turntable.")
    ] = ReconstructionOptions.frames,
    size: Size = ReconstructionOptions.size,
    refine: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            metavar="SECONDS",
            help="Adapt the multi-view blocks to the drawings first, for so long at most; kept only if better.",
        ),
    ] = ReconstructionOptions.refine_seconds,
    bake: BakedFile = ReconstructionOptions.bake,
    device: Device = "auto",
    trust: Trusted = None,
    json_file: JsonFile = None,
) -> None:
    """Turn drawings, or a sheet, into DIR/mesh.glb, DIR/turntable.mp4 (or .gif), views and DIR/report.html.

    The images have alpha or a plain background, any sizes and crops: figures are cut out and brought to one
    height and floor line, and where views disagree the later ones are moved to the earlier ones. What was assumed
    is printed, and drawn in the report.
    """
    began = time.perf_counter()
    check_json(json_file)
    check_baked(bake, symmetric=symmetric)
    options = ReconstructionOptions(
        replace(mesh, faces=faces, texture=texture), frames, size, symmetric, refine, bake
    )
    from charnerf.reconstruction.folder import reconstruct

    model = load_model(weights, device=device, trust=trust)
    done = reconstruct(model, output, options, given.drawings, reading=reading, sheet=given.sheet, say=say)
    close(_summary(done, frames, began), json_file)


def check_baked(file: Path | None, *, symmetric: bool) -> None:
    """Check, before the work, that a baked character can be written."""
    from charnerf.files import check_folder

    if file is None:
        return
    if symmetric:
        raise ConfigError(
            "--bake: found it with --symmetric, whose colours both sides' networks decide; leave one of them out."
        )
    if file.suffix != ".safetensors":
        raise ConfigError(f"--bake: found {file}, expected a name that ends in .safetensors.")
    check_folder(file.parent)


def _summary(done: "Reconstruction", frames: int, began: float) -> Summary:
    """What was made and how good it is."""
    from charnerf.reconstruction.quality import quality_words

    return Summary(
        made=f"a mesh of {counted(len(done.built.mesh.faces), 'face')}, a turntable of {counted(frames, 'frame')}",
        files=(done.report, done.mesh, done.turntable),
        began=began,
        quality=quality_words(done.quality),
        doubts=done.warnings,
        try_=done.suggestions,
        facts=done.facts,
    )
