"""Shapes without meaning, as `data=shapes` names them."""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import final

from charnerf.capture.generated import Generator
from charnerf.capture.generated_data import AbstractGeneratedData
from charnerf.errors import DependencyError
from charnerf.procedural import SHAPES_VERSION, make_shape


@final
@dataclass(frozen=True, kw_only=True)
class ShapesData(AbstractGeneratedData):
    """Assemblies of solids at a character's place; see charnerf/procedural/assembly.py."""

    @property
    def generator(self) -> Generator:
        """Of the extra `shapes`."""
        return shapes_generator()


def shapes_generator() -> Generator:
    """The generator of shapes.

    Raises:
        DependencyError: If manifold3d is not installed.
    """
    if find_spec("manifold3d") is None:
        raise DependencyError(
            "data=shapes and `charnerf generate --shapes` need the package manifold3d: pip install 'charnerf[shapes]'."
        )
    return Generator("shapes", SHAPES_VERSION, make_shape)
