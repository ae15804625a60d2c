"""What every renderer of a capture can do."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from charnerf.capture.lights import AbstractLight
from charnerf.capture.studio import Shot
from charnerf.surfaces.surface_mesh import SurfaceMesh
from charnerf.types import Cameras


@dataclass(frozen=True)
class ReadCharacter:
    """A character out of a file.

    Attributes:
        surface: World frame: 2 m tall, feet on z = 0, middle of its box on the z axis.
        notes: What was simplified or left out.
    """

    surface: SurfaceMesh
    notes: tuple[str, ...] = ()


class AbstractRenderer(ABC):
    """Reads files and takes pictures; sent to other processes.

    Attributes:
        suffixes: Of the files that it reads.
    """

    suffixes: ClassVar[tuple[str, ...]]

    @abstractmethod
    def check(self) -> None:
        """Check, before any work, that it can work here.

        Raises:
            DependencyError: If it can not.
        """

    @abstractmethod
    def name_of(self, file: Path) -> str:
        """Name of the character that `read` makes of a file."""

    @abstractmethod
    def read(self, file: Path, up: str | None, facing: str | None) -> ReadCharacter:
        """Read a character into the world frame.

        Args:
            file: One of its suffixes.
            up: Axis of the file that points up; None for the format's own.
            facing: Signed axis of the file that the character faces; None for the format's own.

        Raises:
            DataError: If it can not be read.
        """

    @abstractmethod
    def shoot(
        self, surface: SurfaceMesh, cameras: Sequence[Cameras], light: AbstractLight, *, depth: bool
    ) -> list[list[Shot]]:
        """Take pictures of a surface.

        Args:
            surface: World frame.
            cameras: Sets (N,) of square cameras of one size, each of one kind at one distance.
            light: How it is lit.
            depth: Whether depth is asked for.

        Returns:
            The pictures of each set.

        Raises:
            DataError: If they can not be taken.
        """

    @abstractmethod
    def facts(self) -> dict[str, Any]:
        """What makes a difference to the pictures, for dataset.json."""
