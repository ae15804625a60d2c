"""What the page's processes answer: records that cross from them to the server, which imports nothing heavy."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Found:
    """Figures of a picture.

    Attributes:
        boxes: By figure: left, top, right and bottom, shares of the picture.
        is_sheet: Whether the figures are parts of it; else it is one drawing as a whole.
    """

    boxes: tuple[tuple[float, float, float, float], ...]
    is_sheet: bool


@dataclass(frozen=True)
class RecognizedView:
    """How one figure was read.

    Attributes:
        number: The figure's.
        view: Its name.
        given: PNG: as it was cut out and aligned, its outline red.
        mended: PNG: as the model takes it, what moved in orange; None where it stays as drawn.
        tone: good, moved or doubtful.
        sentence: How it agrees with the views before it.
    """

    number: int
    view: str
    given: str
    mended: str | None
    tone: str
    sentence: str


@dataclass(frozen=True)
class Recognized:
    """How all figures were read."""

    views: tuple[RecognizedView, ...]
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Level:
    """A mesh that the page shows: its file and faces."""

    file: str
    faces: int


@dataclass(frozen=True)
class Product:
    """What was made of a character.

    Attributes:
        files: What each is, by name; they lie in the folder.
        levels: Meshes, the finest first.
        film: The turntable's file.
        quality: How good it is, one sentence.
        mesh: What the mesh is, in words.
        suggestions: What may make it better.
        notes: What could not be made, and how it can.
        seconds: By stage.
    """

    files: dict[str, str]
    levels: tuple[Level, ...]
    film: str
    quality: str
    mesh: str
    suggestions: tuple[str, ...]
    notes: tuple[str, ...]
    seconds: dict[str, float]
