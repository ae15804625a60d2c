"""The commands that make meshes, `mesh` and `reconstruct`: options and help; registered by `charnerf.cli`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from charnerf.cli.options import Dataset, Device, Folder, Size, Trusted, Weights, WeightsOption

Cameras = Annotated[int, typer.Option(min=1, help="Cameras whose directions the density is averaged over.")]
Height = Annotated[
    float, typer.Option(min=0.001, metavar="M", help="Exact height of the mesh, m; its lowest point is at 0.")
]
Resolution = Annotated[int, typer.Option(min=16, max=1024, help="Grid points along the mesh's longest side.")]
Smooth = Annotated[
    int, typer.Option(min=0, metavar="N", help="Rounds of smoothing of the surface; it does not shrink.")
]
Symmetric = Annotated[
    bool,
    typer.Option(
        "--symmetric", help="Average densities over left and right: for characters that are symmetric."
    ),
]
Texture = Annotated[
    Literal["drawings", "field", "vertex"],
    typer.Option(
        help="Colours: a texture from the drawings, by the field where none sees the surface; a texture by the"
        " field; or colours at vertices, by the field."
    ),
]
TextureSize = Annotated[int, typer.Option(min=16, max=8192, help="Texels a side of the texture.")]


def numbers(text: str | None, name: str, least: int) -> tuple[int, ...]:
    """Whole numbers of a list such as 64,128,256.

    Raises:
        typer.BadParameter: If it is no such list, or a number is below the least.
    """
    if text is None:
        return ()
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdigit() and int(part) >= least for part in parts):
        raise typer.BadParameter(
            f"found '{text}', expected whole numbers from {least} on, such as 64,128.", param_hint=name
        )
    return tuple(int(part) for part in parts)


def mesh(
    *,
    data: Dataset,
    output: Folder,
    character: Annotated[
        str | None, typer.Option(metavar="NAME", help="Character of the data set; this or --split.")
    ] = None,
    split: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="All characters of a split, and DIR/meshes.md: what meshes and each kind of colours are worth.",
        ),
    ] = None,
    weights: Weights = None,
    resolution: Resolution = 128,
    lod: Annotated[
        str | None,
        typer.Option(metavar="N,N,..", help="A mesh for each of these grids, in place of --resolution."),
    ] = None,
    faces: Annotated[
        str | None,
        typer.Option(
            metavar="N[,N..]",
            help="Faces after decimation; all if left out. With several numbers, or with --lod, further meshes.",
        ),
    ] = None,
    cameras: Cameras = 8,
    convergence: Annotated[
        bool,
        typer.Option(
            "--convergence",
            help="Also measure how many cameras are needed, and show levels beside the chosen one: DIR/NAME_cameras.md.",
        ),
    ] = False,
    smooth: Smooth = 0,
    symmetric: Symmetric = False,
    height: Height = 2.0,
    texture: Texture = "vertex",
    texture_size: TextureSize = 1024,
    format_: Annotated[
        Literal["glb", "gltf", "obj", "ply", "stl", "usdz"],
        typer.Option("--format", help="File format; usdz needs the extra `usd`."),
    ] = "glb",
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Make the mesh of a character of a data set: DIR/NAME.glb, metres, and a contact sheet.

    Several levels of detail are DIR/NAME_LOD0.glb (the finest) and so on; their table is printed and
    written to DIR/lods.md and DIR/lods.json.
    """
    from charnerf import commands, commands_meshes
    from charnerf.reconstruction.meshes import MeshRequest

    if (character is None) == (split is None):
        raise typer.BadParameter("expected one of the two.", param_hint="--character, --split")
    request = MeshRequest(
        resolutions=numbers(lod, "--lod", 16) or (resolution,),
        faces=numbers(faces, "--faces", 4),
        are_levels=lod is not None,
        num_cameras=cameras,
        smooth=smooth,
        symmetric=symmetric,
        convergence=convergence,
        height=height,
        texture=texture,
        texture_size=texture_size,
        suffix=format_,
    )
    if split is not None:
        commands_meshes.measure(
            weights, data, split, output, request=request, device=device, trust=trust or []
        )
    if character is not None:
        commands.mesh(weights, data, character, output, request=request, device=device, trust=trust or [])


def reconstruct(
    front: Annotated[
        Path, typer.Argument(metavar="FRONT", exists=True, dir_okay=False, help="Front view, an image.")
    ],
    side: Annotated[Path, typer.Argument(metavar="SIDE", exists=True, dir_okay=False, help="Side view.")],
    back: Annotated[Path, typer.Argument(metavar="BACK", exists=True, dir_okay=False, help="Back view.")],
    *,
    output: Folder,
    weights: WeightsOption = None,
    side_shows: Annotated[
        Literal["left", "right"],
        typer.Option(
            "--side",
            help="Which side of the character SIDE shows; left: its face looks to the picture's left.",
        ),
    ] = "left",
    resolution: Resolution = 128,
    faces: Annotated[int, typer.Option(min=4, help="Faces of the mesh after decimation.")] = 8000,
    frames: Annotated[int, typer.Option(min=1, help="Frames of the turntable.")] = 36,
    size: Size = 192,
    cameras: Cameras = 8,
    smooth: Smooth = 0,
    symmetric: Symmetric = False,
    refine: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            metavar="SECONDS",
            help="Adapt the multi-view blocks to the drawings first, for so long at most; kept only if better.",
        ),
    ] = None,
    height: Height = 2.0,
    texture: Texture = "drawings",
    texture_size: TextureSize = 1024,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Turn three drawings into DIR/mesh.glb, DIR/turntable.mp4 (or .gif), views and DIR/report.md.

    The images have alpha or a plain background, any sizes and crops: figures are cut out and brought to one
    height and floor line. What was assumed is printed, and drawn in the report.
    """
    from charnerf import commands

    commands.reconstruct(
        (front, side, back),
        output,
        weights=weights,
        side_is=side_shows,
        resolution=resolution,
        faces=faces,
        frames=frames,
        size=size,
        cameras=cameras,
        smooth=smooth,
        symmetric=symmetric,
        refine=refine,
        height=height,
        texture=texture,
        texture_size=texture_size,
        device=device,
        trust=trust or [],
    )
