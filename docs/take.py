"""Take what runs left into docs/: `python -m docs.take docs/weights/metrics_real_characters.json measured/metrics.json`.

A JSON file is copied without the folders of the machine that it was measured on. Of several curve.csv, in the order in
which one run went on from another, one is made. Then `python -m docs`.
"""

import argparse
import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

Row = dict[str, str]
GROWING = ("seconds", "step")


def published(content: Any) -> Any:
    """JSON in which absolute paths are cut to their last name."""
    if isinstance(content, dict):
        return {key: published(item) for key, item in content.items()}
    if isinstance(content, list):
        return [published(item) for item in content]
    if isinstance(content, str) and content.startswith("/"):
        return Path(content).name
    return content


def joined(curves: Sequence[Sequence[Row]]) -> list[Row]:
    """One curve of runs that went on from one another: seconds and steps that begin anew are added to those before."""
    found: list[Row] = []
    for curve in curves:
        rows = [dict(row) for row in curve]
        for key in GROWING:
            before = max((float(row[key]) for row in found), default=0.0)
            if rows and float(rows[0][key]) < before:
                rows = [{**row, key: f"{float(row[key]) + before:g}"} for row in rows]
        found += rows
    return found


def take(destination: Path, files: Sequence[Path]) -> None:
    """Write one file from one JSON file, or from the curves of several runs."""
    if destination.suffix == ".json":
        (file,) = files
        content = published(json.loads(file.read_text(encoding="utf-8")))
        destination.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        return
    curves = []
    for file in files:
        with file.open(newline="", encoding="utf-8") as opened:
            curves.append(list(csv.DictReader(opened)))
    rows = joined(curves)
    with destination.open("w", newline="", encoding="utf-8") as opened:
        writer = csv.DictWriter(opened, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("destination", type=Path, help="file below docs/, .json or .csv")
    parser.add_argument("files", type=Path, nargs="+", help="metrics.json, or curve.csv in order")
    arguments = parser.parse_args()
    take(arguments.destination, arguments.files)
