"""What reports are made of: blocks, which document.py writes as Markdown and page.py as HTML."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote


@dataclass(frozen=True)
class Heading:
    """A title of level 1 or 2."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Text:
    """A paragraph; the lead says the result in one breath."""

    text: str
    lead: bool = False


@dataclass(frozen=True)
class Bullets:
    """A list of short facts; `warnings` stand out."""

    items: Sequence[str]
    warnings: bool = False


@dataclass(frozen=True)
class Code:
    """Lines to type or to keep; `folded` under a title."""

    text: str
    folded: str | None = None


@dataclass(frozen=True)
class Table:
    """Cells as text; the first row may be the one that matters (`emphasis`)."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    emphasis: bool = False


@dataclass(frozen=True)
class Picture:
    """A picture file below the report's folder."""

    path: Path
    caption: str


@dataclass(frozen=True)
class Film:
    """A turntable below the report's folder, MP4 or GIF, and a picture to be seen before it plays."""

    path: Path
    caption: str
    still: Path


@dataclass(frozen=True)
class Mesh:
    """A GLB below the report's folder, to be turned in HTML."""

    path: Path
    caption: str


@dataclass(frozen=True)
class SideBySide:
    """Pictures or meshes side by side, as many as the page has room for."""

    items: "Sequence[Picture | Film | Mesh]"


@dataclass(frozen=True)
class Files:
    """What lies beside the report: names relative to its folder, and what each is."""

    entries: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Plot:
    """A diagram that can be pointed at and zoomed.

    Attributes:
        figure: Data and layout as plotly's JSON writes them.
        picture: The same, still: for Markdown, and for HTML where plotly is not installed.
    """

    figure: Mapping[str, Any]
    picture: Picture


Block = Heading | Text | Bullets | Code | Table | Picture | Film | Mesh | SideBySide | Files | Plot


def link(path: Path | str) -> str:
    """A path relative to the report as an address."""
    return quote(Path(path).as_posix(), errors="surrogateescape")
