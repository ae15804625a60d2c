"""One character captured: pictures of its surface from all around, and its source views."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import trimesh

from charnerf.capture.lights import AbstractLight, Unlit
from charnerf.capture.renderers.base import AbstractRenderer
from charnerf.capture.renderers.built_in import BuiltIn
from charnerf.capture.studio import Studio
from charnerf.data.characters import CharacterPictures
from charnerf.errors import ConfigError
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.geometry.framing import SOURCE_ORDER, framing_cameras, source_cameras
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import SurfaceMesh


@dataclass(frozen=True)
class CaptureOptions:
    """How a character is captured.

    Attributes:
        views: Target pictures, on a Fibonacci lattice of the upper hemisphere.
        size: Side of every picture, pixels.
        sources: Projection of the source views.
        depth: Whether to keep depth pictures.
        light: How the surface is lit.
        renderer: What takes the pictures.
    """

    views: int = 48
    size: int = 128
    sources: Literal["orthographic", "pinhole"] = "orthographic"
    depth: bool = False
    light: AbstractLight = field(default_factory=Unlit)
    renderer: AbstractRenderer = field(default_factory=BuiltIn)

    def __post_init__(self) -> None:
        """Check the options.

        Raises:
            ConfigError: If one is out of its range.
        """
        for name, least in (("views", 1), ("size", 8)):
            if getattr(self, name) < least:
                raise ConfigError(f"{name}: found {getattr(self, name)}, expected at least {least}.")
        if self.sources not in ("orthographic", "pinhole"):
            raise ConfigError(f"sources: found {self.sources!r}, expected 'orthographic' or 'pinhole'.")


@dataclass(frozen=True)
class CapturedCharacter:
    """Pictures and cameras of a character, and the surface that they were taken of."""

    pictures: CharacterPictures
    surface: SurfaceMesh


def capture_character(
    scene: trimesh.Scene | trimesh.Trimesh | SurfaceMesh, options: CaptureOptions
) -> CapturedCharacter:
    """Take all pictures of a scene that stands in the world frame.

    Args:
        scene: World frame, from `meshes.load_scene` or a generator; or its surface.
        options: How.

    Returns:
        Pictures with their cameras: pinhole targets, and the source views front, side, back.

    Raises:
        DataError: If the scene has no triangles, or its pictures can not be taken.
    """
    surface = scene if isinstance(scene, SurfaceMesh) else surface_of_scene(scene)
    radius, size = surface.framing_radius, options.size
    targets = framing_cameras(fibonacci_hemisphere(options.views), radius=radius, size=size)
    sources = source_cameras(radius=radius, size=size, orthographic=options.sources == "orthographic")
    shots, source_shots = options.renderer.shoot(
        surface, (targets, sources), options.light, depth=options.depth
    )
    pictures = CharacterPictures(
        cameras=targets,
        images=np.stack([shot.rgba for shot in shots]),
        source_cameras=sources,
        source_images=np.stack([shot.rgba for shot in source_shots]),
        source_names=SOURCE_ORDER,
        depths=np.stack([shot.depth for shot in shots]) if options.depth else None,
    )
    return CapturedCharacter(pictures=pictures, surface=surface)


def capture_sources(surface: SurfaceMesh, size: int, azimuths_deg: Sequence[float]) -> np.ndarray:
    """Orthographic source views of a surface, level at azimuths, RGBA uint8 (V, size, size, 4)."""
    cameras = source_cameras(radius=surface.framing_radius, size=size, azimuths_deg=azimuths_deg)
    return np.stack([shot.rgba for shot in Studio(surface, Unlit()).shoot(cameras)])
