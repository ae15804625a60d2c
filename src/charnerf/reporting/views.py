"""views.csv of a run: the metrics of every view, by method, character and angle."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from charnerf.errors import DataError

OURS = "ours"
_WORDS = ("method", "character", "view")


@dataclass(frozen=True)
class View:
    """One view by one method: numbers by column, those that could not be had left out."""

    method: str
    character: str
    view: str
    numbers: dict[str, float]


@dataclass(frozen=True)
class ViewTable:
    """All views of a run."""

    views: tuple[View, ...]

    def of(self, method: str) -> list[View]:
        """Views by one method."""
        return [view for view in self.views if view.method == method]

    def per_character(self, key: str, method: str = OURS) -> dict[str, float]:
        """Mean of a column over the views of each character."""
        return mean_by_character(self.of(method), key)


def mean_by_character(views: Iterable[View], key: str) -> dict[str, float]:
    """Mean of a column over the views of each character that have it, characters in order of appearance."""
    values: dict[str, list[float]] = {}
    for view in views:
        if key in view.numbers:
            values.setdefault(view.character, []).append(view.numbers[key])
    return {name: fmean(found) for name, found in values.items()}


def read_views(path: Path) -> ViewTable:
    """Read a views.csv.

    Raises:
        DataError: If it is unreadable or not such a table.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return ViewTable(tuple(_view(row) for row in rows))
    except (OSError, UnicodeDecodeError, csv.Error, KeyError, ValueError, TypeError) as error:
        raise DataError(
            f"{path}: can not be read ({type(error).__name__}: {error}), expected the table of views that an "
            "evaluation wrote; run `charnerf evaluate` again."
        ) from error


def _view(row: dict[str, str]) -> View:
    numbers = {key: float(cell) for key, cell in row.items() if key not in _WORDS and cell != ""}
    return View(row["method"], row["character"], row["view"], numbers)
