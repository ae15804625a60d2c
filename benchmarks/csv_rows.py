"""Rows of figures to a CSV file."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path


def write_rows(file: Path, rows: Iterable[Mapping[str, object]]) -> None:
    """Write rows to a file, each as soon as it is measured, and show it on standard error.

    Args:
        file: Its folder is made.
        rows: Cells by title; all have the first one's titles.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w", newline="", encoding="utf-8") as opened:
        writers: list[csv.DictWriter[str]] = []
        for row in rows:
            if not writers:
                writers = [
                    csv.DictWriter(one, list(row), lineterminator="\n") for one in (opened, sys.stderr)
                ]
                for writer in writers:
                    writer.writeheader()
            for writer in writers:
                writer.writerow(row)
            opened.flush()
