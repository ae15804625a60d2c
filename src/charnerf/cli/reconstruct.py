"""`charnerf reconstruct`: three drawings to a mesh, a turntable, views and a report."""

from typing import Annotated

import typer

from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import (
    Back,
    Cameras,
    Colors,
    Device,
    Folder,
    Front,
    Height,
    Resolution,
    Side,
    SideShows,
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
    front: Front,
    side: Side,
    back: Back,
    *,
    output: Folder,
    weights: WeightsOption = None,
    side_shows: SideShows = "left",
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
    """Turn three drawings into DIR/mesh.glb, DIR/turntable.mp4 (or .gif), views and DIR/report.md.

    The images have alpha or a plain background, any sizes and crops: figures are cut out and brought to one
    height and floor line. What was assumed is printed, and drawn in the report.
    """
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
    done = reconstruct(model, output, options, front=front, side=side, back=back, side_is=side_shows, say=say)
    say(f"{done.mesh}, {done.turntable}, {done.report}: {sum(done.seconds.values()):.0f} s.")
