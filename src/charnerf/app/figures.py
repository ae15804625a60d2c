"""One figure of a picture that was dropped on the page: which view it shows, as found or as the user says."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from charnerf.drawings.viewpoints import AZIMUTHS, Viewpoint, viewpoint
from charnerf.errors import DataError

LEFT_OUT = ""
WORDS = {"front": "front", "left": "left", "right": "right", "back": "back", "rear": "back"}
SIDES = ("side", "profile")  # left or right, whichever way the figure looks
BETWEEN = ("three", "quarter", "34")  # what it is, its file's name does not say whole


@dataclass(frozen=True)
class Figure:
    """One figure.

    Attributes:
        number: Of the session's figures, never given twice.
        file: The picture.
        title: What the page calls it.
        part: Which of the picture's figures; None where it shows one alone and is taken whole.
        box: Left, top, right and bottom, shares of the picture.
        view: From where it is seen, as `drawings.viewpoints.viewpoint` reads it; LEFT_OUT where it is not used.
        is_mirrored: Whether it is turned left to right before it is read.
    """

    number: int
    file: Path
    title: str
    part: int | None
    box: tuple[float, float, float, float]
    view: str = LEFT_OUT
    is_mirrored: bool = False

    @property
    def is_used(self) -> bool:
        """Whether it is a view of the character."""
        return self.view != LEFT_OUT


def view_text(view: Viewpoint | None) -> str:
    """A viewpoint as `viewpoint` reads it; LEFT_OUT of None."""
    if view is None:
        return LEFT_OUT
    if view.name in AZIMUTHS:
        return view.name
    level = view.elevation_deg == 0.0
    return f"{view.azimuth_deg:g}" if level else f"{view.azimuth_deg:g},{view.elevation_deg:g}"


def view_by_name(title: str) -> str | None:
    """The view that a file's name tells, such as front of hero_front.png; `side` where it does not say which; else None."""
    words = re.findall(r"[a-z]+|\d+", Path(title).stem.lower())
    if any(word in BETWEEN for word in words):
        return None
    told = {WORDS[word] for word in words if word in WORDS}
    if len(told) == 1:
        return told.pop()
    return "side" if not told and any(word in SIDES for word in words) else None


def in_order(figures: Iterable[Figure]) -> list[Figure]:
    """Those that are used, in the order in which they rule where they disagree: front, sides, back.

    Raises:
        DataError: If two show one view, or there are fewer than two.
    """
    used = [(viewpoint(one.view), one) for one in figures if one.is_used]
    used.sort(key=lambda pair: pair[0].rank)
    names = [view.name for view, _ in used]
    for name in names:
        if names.count(name) > 1:
            raise DataError(f"Two figures are called {name}: rename one of them, swap, or leave one out.")
    if len(used) < 2:
        found = {0: "no view", 1: "one view"}[len(used)]
        raise DataError(
            f"There is {found} so far, expected two or more, such as front and side: add a drawing, or name a figure that is left"
            " out."
        )
    return [one for _, one in used]
