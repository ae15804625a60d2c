"""Files read and rays cast by charnerf itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, final

from charnerf.capture.lights import AbstractLight
from charnerf.capture.meshes import SUFFIXES, load_scene
from charnerf.capture.renderers.base import AbstractRenderer, ReadCharacter
from charnerf.capture.studio import EDGE_SUBSAMPLES, SUBSAMPLES, Shot, Studio
from charnerf.errors import ConfigError
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import SurfaceMesh
from charnerf.types import Cameras


@final
@dataclass(frozen=True)
class BuiltIn(AbstractRenderer):
    """Needs no other program.

    Attributes:
        subsamples: Rays a pixel.
        edge_subsamples: Rays for each pixel that the silhouette crosses.
    """

    suffixes: ClassVar[tuple[str, ...]] = SUFFIXES
    subsamples: int = SUBSAMPLES
    edge_subsamples: int = EDGE_SUBSAMPLES

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ConfigError: If one is below 1.
        """
        for name in ("subsamples", "edge_subsamples"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name}: found {getattr(self, name)}, expected at least 1.")

    def check(self) -> None:
        """It works everywhere."""

    def name_of(self, file: Path) -> str:
        """The file's stem."""
        return file.stem

    def read(self, file: Path, up: str | None, facing: str | None) -> ReadCharacter:
        """Read a mesh file (capture/meshes.py)."""
        return ReadCharacter(surface_of_scene(load_scene(file, up, facing)))

    def shoot(
        self, surface: SurfaceMesh, cameras: Sequence[Cameras], light: AbstractLight, *, depth: bool
    ) -> list[list[Shot]]:
        """Cast rays (capture/studio.py); depth costs nothing."""
        studio = Studio(surface, light, subsamples=self.subsamples, edge_subsamples=self.edge_subsamples)
        return [studio.shoot(each) for each in cameras]

    def facts(self) -> dict[str, Any]:
        """Its name."""
        return {"renderer": "builtin"}
