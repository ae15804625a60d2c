"""From where a drawing shows its character: names that artists use, and angles."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

from charnerf.errors import DataError
from charnerf.wording import typed_or_clicked

Drawn = TypeVar("Drawn")

AZIMUTHS = {
    "front": 0.0,
    "three-quarter-front": 45.0,
    "left": 90.0,
    "three-quarter-back": 135.0,
    "back": 180.0,
    "three-quarter-back-right": 225.0,
    "right": 270.0,
    "three-quarter-front-right": 315.0,
}
"""Degrees, 0 the front, 90 the character's left side, by name; three-quarter views show the left side unless they say right."""

FACING = 0.1  # sine of an azimuth below which a view is from the front or back
SIDEWAYS = 0.9  # the same above which it is from a side, and bounds the depth
NEAR = 1.0  # degrees: two drawings nearer to each other than this show one view
HIGHEST = 80.0  # degrees of elevation: from straight above a figure has no floor line


@dataclass(frozen=True)
class Viewpoint:
    """Where a drawing's viewer stands.

    Attributes:
        azimuth_deg: In [0, 360): 0 sees the front, 90 the character's left side, 180 the back.
        elevation_deg: 0 level, positive from above.
    """

    azimuth_deg: float
    elevation_deg: float = 0.0

    def __post_init__(self) -> None:
        """Bring the azimuth into [0, 360).

        Raises:
            DataError: If an angle is not finite or the elevation too steep.
        """
        if not math.isfinite(self.azimuth_deg) or not abs(self.elevation_deg) <= HIGHEST:
            raise DataError(
                f"view: found azimuth {self.azimuth_deg}, elevation {self.elevation_deg}, expected finite degrees and an"
                f" elevation within {HIGHEST:g}."
            )
        object.__setattr__(self, "azimuth_deg", float(self.azimuth_deg) % 360.0)
        object.__setattr__(self, "elevation_deg", float(self.elevation_deg))

    @property
    def rank(self) -> tuple[float, float]:
        """Sorts views of a sheet as they rule where they disagree: front, sides, back, a left one before a right one."""
        return min(self.azimuth_deg, 360.0 - self.azimuth_deg), self.azimuth_deg

    @property
    def name(self) -> str:
        """Its name where it has one, else its angles."""
        if self.elevation_deg == 0.0:
            for name, azimuth in AZIMUTHS.items():
                if azimuth == self.azimuth_deg:
                    return name
            return f"{self.azimuth_deg:g} degrees"
        return f"{self.azimuth_deg:g},{self.elevation_deg:g} degrees"


def between_square_ones(viewpoints: Sequence[Viewpoint]) -> list[Viewpoint]:
    """Those that look neither from the front nor a side nor the back, where all three of these are there; else none.

    The released weights were trained on the three; a view between them costs more than it shows (docs/drawings.md).
    """
    azimuths = {one.azimuth_deg for one in viewpoints}
    if not ({0.0, 180.0} <= azimuths and azimuths & {90.0, 270.0}):
        return []
    return [one for one in viewpoints if one.azimuth_deg % 90.0]


def call_it(view: str) -> str:
    """What to do where a figure is seen from somewhere else than it was said to be, in the middle of a sentence."""
    return typed_or_clicked(f"say --side {view}, or of a sheet --figure {view}=N", f"call it {view}")


def is_turned(azimuth_deg: float) -> bool:
    """Whether a view is neither from the front nor from the back."""
    return _across(azimuth_deg) > FACING


def side_missing(viewpoints: Sequence[Viewpoint]) -> Viewpoint | None:
    """The side that bounds the depth and is not there; None where one is, or two others, or a view from above, do that too.

    It is the side next to the one view between front, side and back, the left one where there is none. Without a front or a
    back nothing is missing: there is nothing to guess from.
    """
    between = [one for one in viewpoints if is_turned(one.azimuth_deg)]
    if len(between) > 1 or len(between) == len(viewpoints) or any(one.elevation_deg for one in viewpoints):
        return None
    if any(_across(one.azimuth_deg) > SIDEWAYS for one in viewpoints):
        return None
    return viewpoint("right" if between and between[0].azimuth_deg > 180.0 else "left")


def viewpoint(text: str | float) -> Viewpoint:
    """Read a name such as `left`, an azimuth such as 45, or azimuth and elevation such as `45,20`.

    Raises:
        DataError: If it is none of them.
    """
    if isinstance(text, str) and text in AZIMUTHS:
        return Viewpoint(AZIMUTHS[text])
    try:
        numbers = [float(part) for part in str(text).split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise DataError(
            f"view: found '{text}', expected one of {', '.join(AZIMUTHS)}, an azimuth in degrees such as 45, or azimuth and"
            " elevation such as 45,20."
        )
    return Viewpoint(*numbers)


def turnaround(front: Drawn, side: Drawn, back: Drawn, *, side_is: str = "left") -> dict[Viewpoint, Drawn]:
    """Three drawings by where they are seen from.

    Args:
        front: The character faces the viewer.
        side: In profile.
        back: Seen from behind.
        side_is: "left": the character's left side is seen, it looks towards the picture's left. "right": its right side.

    Raises:
        DataError: If the side is another one.
    """
    if side_is not in ("left", "right"):
        raise DataError(
            f"side: found '{side_is}', expected 'left' or 'right': which side of the character is drawn."
        )
    return {viewpoint("front"): front, viewpoint(side_is): side, viewpoint("back"): back}


def check_viewpoints(drawings: Mapping[Viewpoint, object]) -> None:
    """Refuse drawings (files, or what is none) that are too few, or of which two show one view or are one file.

    Raises:
        DataError: With the view or the file.
    """
    if len(drawings) < 2:
        raise DataError(
            f"drawings: found {len(drawings)}, expected at least two, such as front and side: from one drawing alone no depth"
            " can be told."
        )
    azimuths = sorted(one.azimuth_deg for one in drawings)
    for first, second in pairwise([*azimuths, azimuths[0] + 360.0]):
        if second - first < NEAR:
            raise DataError(
                f"view {first:g}: found two drawings from this azimuth, expected one from each. Leave one out, or say where it"
                " is seen from, such as 45 degrees."
            )
    files = [str(source) for source in drawings.values() if isinstance(source, (str, Path))]
    for file in files:
        if files.count(file) > 1:
            raise DataError(
                f"{file}: given for two views, expected another drawing for each. Leave one of the views out."
            )


def _across(azimuth_deg: float) -> float:
    """How far from the side a viewer stands: 0 before or behind the figure, 1 beside it."""
    return abs(math.sin(math.radians(azimuth_deg)))
