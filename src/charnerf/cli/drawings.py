"""Drawings on a command line: three files, a sheet, or files by where they are seen from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from charnerf.cli.messages import say
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.segmenters import segmenter_by_name
from charnerf.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np

    from charnerf.drawings.read_sheet import SheetViews
    from charnerf.drawings.viewpoints import Viewpoint

Files = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="FRONT SIDE [BACK] | SHEET",
        exists=True,
        dir_okay=False,
        help="Front, side and back view, or front and side, or one picture with several figures.",
    ),
]
SideShows = Annotated[
    Literal["left", "right"],
    typer.Option(
        "--side",
        help="Which side of the character SIDE shows; left: its face looks to the picture's left.",
    ),
]
Seen = Annotated[
    list[str] | None,
    typer.Option(
        "--view",
        metavar="VIEW=FILE",
        help="A further drawing: its azimuth in degrees (0 front, 90 left side, 180 back), azimuth,elevation, or a name such"
        " as three-quarter-front; several times. Where drawings disagree, the first given rules.",
    ),
]
Order = Annotated[
    str | None,
    typer.Option(
        metavar="VIEW,VIEW,..",
        help="What the figures of SHEET show, row by row from the left, such as front,side,back; - leaves one out.",
    ),
]
FigureOf = Annotated[
    list[str] | None,
    typer.Option("--figure", metavar="VIEW=N", help="Figure of SHEET that shows a view; several times."),
]
AsDrawn = Annotated[
    bool,
    typer.Option(
        "--as-drawn",
        help="Take views as they are drawn, also where they disagree; else they are mended, and a missing side is guessed.",
    ),
]

KeepInk = Annotated[
    bool,
    typer.Option(
        "--keep-ink",
        help="Take lines along outlines for paint; else they are painted over with the colours beside them.",
    ),
]

Segmenter = Annotated[
    str,
    typer.Option(
        metavar="paper|rembg[:MODEL]",
        help="What tells figures without alpha from their background: its plain colour, or a network whose file is on this machine"
        " (extra rembg), for photographs and painted scenes.",
    ),
]


def reading_options(
    *, as_drawn: AsDrawn = False, keep_ink: KeepInk = False, segmenter: Segmenter = "paper"
) -> ReadingOptions:
    """How drawings are read."""
    segment = segmenter_by_name(segmenter)
    return ReadingOptions(reconciled=not as_drawn, keep_ink=keep_ink, segment=segment)


@dataclass(frozen=True)
class GivenDrawings:
    """Drawings by where they are seen from, and the sheet that they were found on."""

    drawings: Mapping["Viewpoint", "Path | np.ndarray"]
    sheet: "SheetViews | None" = None

    def __post_init__(self) -> None:
        """Check, before the model is loaded, that they are of views apart.

        Raises:
            DataError: If not.
        """
        from charnerf.drawings.viewpoints import check_viewpoints

        check_viewpoints(self.drawings)


def drawings_options(
    drawings: Files = None,
    *,
    side_shows: SideShows = "left",
    view: Seen = None,
    order: Order = None,
    figure: FigureOf = None,
) -> GivenDrawings:
    """The drawings of a command line, as `given_drawings` finds them."""
    return given_drawings(drawings, view, side_shows=side_shows, order=order, figures=figure, say=say)


def given_drawings(
    files: Sequence[Path] | None,
    seen: Sequence[str] | None,
    *,
    side_shows: str,
    order: str | None,
    figures: Sequence[str] | None,
    say: Callable[[str], object],
) -> GivenDrawings:
    """Find out what a command line shows from where; of a sheet it is said what was taken for what.

    Raises:
        ConfigError: If files and options do not fit together.
        DataError: If a view has no such name, or a sheet can not be read.
    """
    from charnerf.drawings.read_sheet import read_sheet
    from charnerf.drawings.viewpoints import viewpoint

    files = list(files or [])
    by_view = _pairs(seen, "--view")
    is_sheet = len(files) == 1 and not by_view
    if (order or figures) and not is_sheet:
        raise ConfigError(
            "--order, --figure: found without a SHEET, expected one picture with several figures."
        )
    if is_sheet:
        read = read_sheet(
            files[0],
            order=order.split(",") if order else (),
            figures={name: _number(number) for name, number in _pairs(figures, "--figure")},
        )
        for line in (*read.assumptions, *(f"warning: {one}" for one in read.warnings)):
            say(line)
        return GivenDrawings(read.drawings, read)
    if len(files) > 3:
        raise ConfigError(
            f"{' '.join(map(str, files))}: found {len(files)} files, expected FRONT SIDE BACK; give further ones by --view."
        )
    names = ("front", side_shows, "back")
    drawings = {viewpoint(name): file for name, file in zip(names, files, strict=False)}
    for name, file in by_view:
        if viewpoint(name) in drawings:
            raise ConfigError(
                f"--view {name}: found this view twice, expected one drawing of it. Leave one out, or give the azimuth that it is"
                " seen from, such as --view 45=FILE."
            )
        if not Path(file).is_file():
            raise ConfigError(f"--view {name}={file}: found no such file. Check the path.")
        drawings[viewpoint(name)] = Path(file)
    return GivenDrawings(drawings)


def _pairs(texts: Sequence[str] | None, option: str) -> list[tuple[str, str]]:
    """Views and values of VIEW=VALUE, each view once."""
    pairs = [_split(text, option) for text in texts or []]
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"{option} {name}: found this view twice, expected it once. Leave one out.")
    return pairs


def _split(text: str, option: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name or not value:
        raise ConfigError(f"{option}: found '{text}', expected VIEW=..., such as back=3 or 45=FILE.")
    return name, value


def _number(text: str) -> int:
    if not text.isdigit():
        raise ConfigError(
            f"--figure: found '{text}', expected a number, counted from 1 row by row from the left."
        )
    return int(text)
