"""The files that a run leaves, read: metrics.json, curve.csv and views.csv."""

import csv
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from charnerf.data.layout import check_view_name
from charnerf.errors import DataError
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.files import read_text
from charnerf.reporting.metrics_shape import check_metrics

_METRICS_KEYS = (
    *METRIC_KEYS,
    "split",
    "num_characters",
    "num_views",
    "by_azimuth",
    "per_character",
    "seconds",
)
MOST_CELLS = 10_000_000  # of a table
_VIEW_WORDS = ("method", "character", "view")

Curve = list[dict[str, float]]
"""Rows of a curve.csv: validation figures by training seconds."""


@dataclass(frozen=True)
class View:
    """One view by one method: numbers by column, those that could not be had left out."""

    method: str
    character: str
    view: str
    numbers: dict[str, float]


def read_metrics(path: Path) -> dict[str, Any]:
    """Content of a metrics.json.

    Raises:
        DataError: If it is missing, no JSON, or lacks the metrics.
    """
    try:
        metrics = json.loads(read_text(path))
    except DataError:
        raise
    except FileNotFoundError as error:
        raise DataError(
            f"{path}: no such file, expected a finished evaluation; run `charnerf evaluate`."
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"{path}: is not readable JSON ({error}); run `charnerf evaluate` again.") from error
    missing = [key for key in _METRICS_KEYS if not isinstance(metrics, dict) or key not in metrics]
    if missing:
        raise DataError(f"{path}: lacks {', '.join(missing)}; run `charnerf evaluate` again.")
    check_metrics(metrics, path)
    return dict(metrics)


def read_curve(path: Path) -> Curve:
    """Rows of a curve.csv as numbers; cells that are empty or no numbers are left out.

    Raises:
        DataError: If the file has no column `seconds`.
    """
    names, rows = _read_table(path)
    if "seconds" not in names:
        columns = ", ".join(names)[:200] or "none"
        raise DataError(
            f"{path}: found the columns {columns}, expected `seconds` among "
            "them; the run's curve.csv is another file or was cut off."
        )
    return [_finite_cells(row) for row in rows]


def _read_table(path: Path) -> tuple[list[str], list[dict[str, Any]]]:
    """Names of a CSV file's first line, and rows by them.

    Raises:
        DataError: If it can not be read.
    """
    try:
        reader = csv.DictReader(read_text(path).splitlines())
        names = [str(name) for name in reader.fieldnames or ()]
        most = MOST_CELLS // max(1, len(names))
        rows = list(islice(reader, most + 1))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: can not be read ({error}), expected a table that a run wrote.") from error
    if len(rows) > most:  # a row of two bytes has all columns in memory
        raise DataError(f"{path}: found more than {most} rows of {len(names)} columns, expected fewer.")
    return names, rows


def _finite_cells(row: Mapping[str, Any]) -> dict[str, float]:
    """The cells of a row that are finite numbers."""
    numbers = {}
    for key, cell in row.items():
        try:
            value = float(cell)
        except (TypeError, ValueError):
            continue
        if math.isfinite(value):
            numbers[key] = value
    return numbers


def curve_points(curve: Curve, key: str) -> tuple[list[float], list[float]]:
    """Seconds and values of a column, where both are there."""
    rows = [row for row in curve if "seconds" in row and key in row]
    return [row["seconds"] for row in rows], [row[key] for row in rows]


def read_views(path: Path) -> list[View]:
    """Read a views.csv.

    Raises:
        DataError: If it is unreadable or not such a table.
    """
    try:
        return [_view(row) for row in _read_table(path)[1]]
    except (KeyError, ValueError, TypeError) as error:
        raise DataError(
            f"{path}: can not be read ({type(error).__name__}: {error}), expected the table of views that an "
            "evaluation wrote; run `charnerf evaluate` again."
        ) from error


def _view(row: dict[str, str]) -> View:
    numbers = {key: float(cell) for key, cell in row.items() if key not in _VIEW_WORDS and cell != ""}
    if not all(abs(value) < math.inf for value in numbers.values()):
        raise ValueError("a cell is no finite number")
    for name in ("character", "view"):
        check_view_name("a row", row[name])
    return View(row["method"], row["character"], row["view"], numbers)
