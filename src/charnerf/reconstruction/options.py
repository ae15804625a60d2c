"""What is made of a character's drawings. As the options of meshes, it imports nothing heavy."""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from charnerf.meshing.options import MeshOptions

LIGHT = MeshOptions(faces=8000, texture="drawings")  # and colored as the drawings are


@final
@dataclass(frozen=True)
class ReconstructionOptions:
    """What is made of a character's drawings.

    Attributes:
        mesh: How its mesh is made.
        frames: Frames of the turntable.
        size: Side of pictures, pixels; 36 of 192 take some seconds on two cores.
        symmetric: Average densities over left and right, for mesh and pictures.
        refine_seconds: Time in which the multi-view blocks are adapted to the drawings first; None leaves it.
        bake: File that the baked character is written to, to be looked at without the network; None writes none.
    """

    mesh: MeshOptions = LIGHT
    frames: int = 36
    size: int = 192
    symmetric: bool = False
    refine_seconds: float | None = None
    bake: Path | None = None
