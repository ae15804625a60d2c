"""`charnerf reconstruct`: drawings or a sheet to a mesh, a turntable, views and a report."""

from typing import Annotated

import typer

from charnerf.cli.drawings import AsDrawn, FigureOf, Files, Order, Seen, SideShows, given_drawings
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import (
    Cameras,
    Colors,
    Device,
    Folder,
    Height,
    Resolution,
    Size,
    Smooth,
    Symmetric,
    TextureSize,
    Trusted,
    WeightsOption,
)
from charnerf.meshing.options import MeshOptions
from charnerf.reconstruction.options import LIGHT, ReconstructionOptions


def command(
    drawings: Files = None,
    *,
    output: Folder,
    side_shows: SideShows = "left",
    view: Seen = None,
    order: Order = None,
    figure: FigureOf = None,
    as_drawn: AsDrawn = False,
    weights: WeightsOption = None,
    resolution: Resolution = LIGHT.resolution,
    faces: Annotated[int | None, typer.Option(help="Faces of the mesh after decimation.")] = LIGHT.faces,
    frames: Annotated[
        int, typer.Option(min=1, help="Frames of the turntable.")
    ] = ReconstructionOptions.frames,
    size: Size = ReconstructionOptions.size,
    cameras: Cameras = LIGHT.num_cameras,
    smooth: Smooth = LIGHT.smooth,
    symmetric: Symmetric = ReconstructionOptions.symmetric,
    refine: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            metavar="SECONDS",
            help="Adapt the multi-view blocks to the drawings first, for so long at most; kept only if better.",
        ),
    ] = ReconstructionOptions.refine_seconds,
    height: Height = LIGHT.height,
    texture: Colors = LIGHT.texture,
    texture_size: TextureSize = LIGHT.texture_size,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Turn drawings, or a sheet, into DIR/mesh.glb, DIR/turntable.mp4 (or .gif), views and DIR/report.md.

    The images have alpha or a plain background, any sizes and crops: figures are cut out and brought to one
    height and floor line, and where views disagree the later ones are moved to the earlier ones. What was assumed
    is printed, and drawn in the report.
    """
    given = given_drawings(drawings, view, side_shows=side_shows, order=order, figures=figure, say=say)
    mesh = MeshOptions(
        resolution=resolution,
        num_cameras=cameras,
        faces=faces,
        smooth=smooth,
        height=height,
        texture=texture,
        texture_size=texture_size,
    )
    options = ReconstructionOptions(mesh, frames, size, symmetric, refine)
    from charnerf.reconstruction.folder import reconstruct

    model = load_model(weights, device=device, trust=trust)
    done = reconstruct(
        model, output, options, given.drawings, reconciled=not as_drawn, sheet=given.sheet, say=say
    )
    say(f"{done.mesh}, {done.turntable}, {done.report}: {sum(done.seconds.values()):.0f} s.")
