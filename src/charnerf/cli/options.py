"""Options that several commands share: one name, one meaning, one help text."""

import inspect
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from charnerf.cli.completion import characters, splits
from charnerf.meshing.options import MeshOptions, Texture

Weights = Annotated[
    Path | None,
    typer.Argument(
        metavar="RUN_OR_WEIGHTS",
        exists=True,
        help="A run folder, a .ckpt or a .safetensors; the released weights if left out.",
    ),
]
WeightsOption = Annotated[
    Path | None,
    typer.Option(
        "--weights",
        metavar="RUN_OR_WEIGHTS",
        exists=True,
        help="A run folder, a .ckpt or a .safetensors; the released weights if left out.",
    ),
]
Dataset = Annotated[
    Path,
    typer.Option(
        "--data",
        metavar="DATASET",
        exists=True,
        file_okay=False,
        help="Folder with dataset.json; or one of nerfstudio, instant-ngp, NeRF-Blender, pixelNeRF (SRN, NMR) or CO3D.",
    ),
]
SomeDataset = Annotated[
    Path | None,
    typer.Option(
        "--data",
        metavar="DATASET",
        exists=True,
        file_okay=False,
        help="Data set of the characters, ours or a foreign one; embedded ones if left out.",
    ),
]
SplitName = Annotated[
    str, typer.Option("--split", metavar="NAME", autocompletion=splits, help="Split of the data set.")
]
SomeCharacter = Annotated[
    str | None,
    typer.Option(
        "--character", metavar="NAME", autocompletion=characters, help="Its name; the first one if left out."
    ),
]
Folder = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", file_okay=False, help="Folder to write to.")
]
NewDataset = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="DATASET", file_okay=False, help="Data set to write, or to add to."
    ),
]
Device = Annotated[str, typer.Option(help="auto, cpu, cuda, cuda:1, ..: auto takes a GPU if there is one.")]
Trusted = Annotated[
    list[str] | None,
    typer.Option(
        "--trust", metavar="MODULE", help="Module of your own classes that the run's config may name."
    ),
]
Views = Annotated[
    int,
    typer.Option(min=1, max=10_000, help="Target pictures a character, spread over the upper hemisphere."),
]
Size = Annotated[int, typer.Option(min=8, max=4096, help="Side of every picture, pixels.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; one a core if left out.")]
Sources = Annotated[
    Literal["orthographic", "pinhole"], typer.Option(help="Projection of the front, side and back views.")
]
Depth = Annotated[bool, typer.Option("--depth", help="Write depth pictures too (16 bit, mm).")]
Cameras = Annotated[int, typer.Option(help="Cameras whose directions the density is averaged over.")]
Height = Annotated[
    float | None, typer.Option(metavar="M", help="Exact height of the mesh, m; its lowest point is at 0.")
]
Resolution = Annotated[int, typer.Option(max=1024, help="Grid points along the mesh's longest side.")]
Smooth = Annotated[
    int, typer.Option(metavar="N", help="Rounds of smoothing of the surface; it does not shrink.")
]
Symmetric = Annotated[
    bool,
    typer.Option(
        "--symmetric", help="Average densities over left and right: for characters that are symmetric."
    ),
]
Colors = Annotated[
    Texture,
    typer.Option(
        "--texture",
        help="Colours: at vertices, by the field; a texture from the drawings, by the field where none sees the surface;"
        " or a texture by the field.",
    ),
]
TextureSize = Annotated[int, typer.Option(help="Texels a side of the texture.")]


def is_count(text: str, *, least: int = 0, most: int = 10**9) -> bool:
    """Whether a text is a whole number within bounds; other scripts' digits and numbers of many digits are none."""
    return text.isascii() and text.isdigit() and len(text) <= 20 and least <= int(text) <= most


def gathered(**makers: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Let a command take, in place of a parameter, the options of the function that makes its value.

    Args:
        makers: By the command's parameter.
    """
    options = {name: inspect.signature(maker).parameters for name, maker in makers.items()}

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(command).parameters
        parameters = [one for name, each in own.items() for one in options.get(name, {name: each}).values()]

        @wraps(command)
        def gathering(**values: Any) -> None:
            made = {
                name: maker(**{option: values.pop(option) for option in options[name]})
                for name, maker in makers.items()
            }
            command(**made, **values)

        shown = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
        gathering.__signature__ = inspect.Signature(shown)  # type: ignore[attr-defined]
        gathering.__annotations__ = {one.name: one.annotation for one in shown}
        return gathering

    return decorate


def mesh_options(default: MeshOptions) -> Callable[..., MeshOptions]:
    """What makes a mesh's options of those on a command line, with defaults of the command's own."""

    def make(
        *,
        resolution: Resolution = default.resolution,
        cameras: Cameras = default.num_cameras,
        smooth: Smooth = default.smooth,
        height: Height = default.height,
        texture_size: TextureSize = default.texture_size,
    ) -> MeshOptions:
        return replace(
            default,
            resolution=resolution,
            num_cameras=cameras,
            smooth=smooth,
            height=height,
            texture_size=texture_size,
        )

    return make
