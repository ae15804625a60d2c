"""What looks wrong with drawings that could be read all the same."""

from dataclasses import dataclass
from enum import Enum


class DoubtKind(Enum):
    """What a doubt is about."""

    MIRRORED = "mirrored"  # left and right seem swapped
    COPIED = "copied"  # it shows what another one shows
    OTHER = "other"


@dataclass(frozen=True)
class Doubt:
    """What looks wrong with one drawing.

    Attributes:
        about: The drawing's file, or the view.
        sentence: What looks wrong, and what to do.
        kind: What it is about.
    """

    about: str
    sentence: str
    kind: DoubtKind = DoubtKind.OTHER

    def __str__(self) -> str:
        return f"{self.about}: {self.sentence}"
