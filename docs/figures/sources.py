"""Single values and plain tables, from JSON, YAML and CSV files of the repository."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from benchmarks.tables import tables

ROOT = Path(__file__).resolve().parents[2]
BENCH = "docs/speed/bench.json"
BEST = {"↑": max, "↓": min}  # in a column's title: which of its numbers is bold


def value(file: str, key: str, form: str = "") -> str:
    """One number of a JSON or YAML file.

    Args:
        file: Path from the repository's root.
        key: Names joined by slashes; NAME=VALUE takes the first of a list's items whose NAME is VALUE.
        form: As of `format`; with `%` a share, for people.
    """
    found = read(file)
    for name in key.split("/"):
        field, is_search, wanted = name.partition("=")
        if is_search:
            found = next(one for one in found if str(one[field]) == wanted)
        else:
            found = found[int(name) if isinstance(found, list) else name]
    return format(found, form).replace("%", " %")


def table(file: str) -> str:
    """A CSV file as a table; the best numbers of columns with an arrow are bold."""
    header, *rows = read(file)
    for column, title in enumerate(header):
        better = next((BEST[mark] for mark in BEST if mark in title), None)
        numbers = [float(row[column]) for row in rows if _is_number(row[column])]
        if better is None or not numbers:
            continue
        best = better(numbers)
        for row in rows:
            if _is_number(row[column]) and float(row[column]) == best:
                row[column] = f"**{row[column]}**"
    return markdown(header, rows)


def speed(mark: str) -> str:
    """The tables of a part of the benchmark, or its targets."""
    return tables(read(BENCH))[mark]


def markdown(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table; columns of numbers are aligned to the right."""
    lines = [list(map(str, row)) for row in rows]
    rules = ["---:" if all(map(_is_figure, column)) else "---" for column in zip(*lines, strict=True)]
    return "\n".join("| " + " | ".join(line) + " |" for line in (heads, rules, *lines))


def read(file: str) -> Any:
    """The content of a file; of a CSV file its lines, the header first. Free to be changed."""
    path = ROOT / file
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".csv":
        return [list(row) for row in csv.reader(text.splitlines())]
    return yaml.safe_load(text) if path.suffix == ".yaml" else json.loads(text)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_figure(text: str) -> bool:
    return text in ("", "-") or _is_number(text.strip("*").removesuffix(" %"))
