"""Embedded characters, as `data=procedural` names them."""

from dataclasses import dataclass
from typing import final

from charnerf.capture.generated import EMBEDDED, Generator
from charnerf.capture.generated_data import AbstractGeneratedData


@final
@dataclass(frozen=True, kw_only=True)
class ProceduralData(AbstractGeneratedData):
    """Humanoids of many kinds; see charnerf/procedural."""

    @property
    def generator(self) -> Generator:
        """Without any file."""
        return EMBEDDED
