"""`charnerf reconstruct`: drawings or a sheet to a mesh, a turntable, views and a report."""

from dataclasses import replace
from typing import Annotated

import typer

from charnerf.cli.drawings import GivenDrawings, drawings_options, reading_options
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import (
    Device,
    Folder,
    Size,
    Symmetric,
    Trusted,
    WeightsOption,
    gathered,
    mesh_options,
)
from charnerf.drawings.options import ReadingOptions
from charnerf.meshing.options import MeshOptions
from charnerf.reconstruction.options import LIGHT, ReconstructionOptions


@gathered(given=drawings_options, reading=reading_options, mesh=mesh_options(LIGHT))
def command(
    given: GivenDrawings,
    *,
    output: Folder,
    reading: ReadingOptions,
    weights: WeightsOption = None,
    mesh: MeshOptions,
    faces: Annotated[int | None, typer.Option(help="Faces of the mesh after decimation.")] = LIGHT.faces,
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
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Turn drawings, or a sheet, into DIR/mesh.glb, DIR/turntable.mp4 (or .gif), views and DIR/report.html.

    The images have alpha or a plain background, any sizes and crops: figures are cut out and brought to one
    height and floor line, and where views disagree the later ones are moved to the earlier ones. What was assumed
    is printed, and drawn in the report.
    """
    options = ReconstructionOptions(replace(mesh, faces=faces), frames, size, symmetric, refine)
    from charnerf.reconstruction.folder import reconstruct

    model = load_model(weights, device=device, trust=trust)
    done = reconstruct(model, output, options, given.drawings, reading=reading, sheet=given.sheet, say=say)
    say(f"{done.mesh}, {done.turntable}, {done.report}: {sum(done.seconds.values()):.0f} s.")
