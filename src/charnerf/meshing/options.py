"""How a mesh is made of a field: the one record of options, from the doors down to the grid.

It imports nothing heavy: the commands read their defaults here, also to print their help.
"""

from dataclasses import dataclass
from typing import Literal, final, get_args

from charnerf.errors import ConfigError
from charnerf.geometry.world import HEIGHT

Texture = Literal["vertex", "drawings", "field"]


@final
@dataclass(frozen=True)
class MeshOptions:
    """How a mesh is made of a field.

    Attributes:
        resolution: Grid points along the longest side.
        num_cameras: Cameras whose directions the density is averaged over (one where the density sees no direction).
        faces: Faces after decimation; None keeps all. A texture takes a second for 4000 faces.
        smooth: Rounds of smoothing, before decimation; it does not shrink.
        height: Exact height, m, with the lowest point on z = 0; None leaves size and place as the field has them.
        texture: vertex: colors at vertices, by the field. drawings: a base-color texture from the drawings, by the field
            where none sees the surface. field: a texture by the field alone.
        texture_size: Texels a side.

    Raises:
        ConfigError: If one is out of range.
    """

    resolution: int = 128
    num_cameras: int = 8
    faces: int | None = None
    smooth: int = 0
    height: float | None = HEIGHT
    texture: Texture = "vertex"
    texture_size: int = 1024

    def __post_init__(self) -> None:
        ranges: tuple[tuple[str, float, float], ...] = (
            ("resolution", 16, 2048),
            ("num_cameras", 1, 10_000),
            ("faces", 4, 10**9),  # a closed surface has no fewer
            ("smooth", 0, 10_000),
            ("height", 0.001, 1e6),
            ("texture_size", 16, 8192),
        )
        for name, least, most in ranges:
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ConfigError(f"{name}: found {value}, expected at least {least:g} and at most {most:g}.")
        if self.texture not in get_args(Texture):
            raise ConfigError(f"texture: found '{self.texture}', expected {', '.join(get_args(Texture))}.")
