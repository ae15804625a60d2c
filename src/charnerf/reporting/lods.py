"""Table I: levels of detail of runs that made some, beside the paper's."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from charnerf.errors import DataError
from charnerf.files import read_text
from charnerf.meshing.lod import PAPER
from charnerf.reporting.blocks import Block, Heading, Table
from charnerf.reporting.formats import NONE, cell, seconds_text
from charnerf.reporting.rows import Row

LODS_FILE = "lods.json"  # `charnerf mesh --lod` writes it
_KEYS = ("file", "grid", "faces_asked", "vertices", "faces", "parts", "chamfer_mm", "seconds")


def lods(rows: Sequence[Row]) -> list[Block]:
    """The table over all lods.json below the runs; nothing where there is none.

    Raises:
        DataError: If one is unreadable.
    """
    header = [
        "row",
        "mesh",
        "grid",
        "vertices",
        "paper",
        "polygons",
        "paper",
        "parts",
        "Chamfer to the finest, mm",
        "time",
    ]
    cells = [
        [f"{row.label}{_seed(row, place)}", *_cells(level)]
        for row in rows
        for place, run in enumerate(row.runs)
        for path in sorted(run.folder.rglob(LODS_FILE))
        for level in _read(path)
    ]
    return [Heading("Table I"), Table(header, cells)] if cells else []


def _seed(row: Row, place: int) -> str:
    return f", seed {row.runs[place].seed}" if len(row.runs) > 1 else ""


def _read(path: Path) -> list[dict[str, Any]]:
    """Levels of a file, finest first."""
    try:
        levels = json.loads(read_text(path))
        return [{key: level[key] for key in _KEYS} for level in levels]
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataError(
            f"{path}: can not be read ({type(error).__name__}: {error}), expected what `charnerf mesh --lod` writes; remove it."
        ) from error


def _cells(level: dict[str, Any]) -> list[str]:
    """Ours beside the paper's; the paper decimated nothing."""
    theirs = PAPER.get(level["grid"]) if level["faces_asked"] is None else None
    vertices, polygons = ("", "") if theirs is None else (str(number) for number in theirs)
    return [
        str(level["file"]),
        str(level["grid"]),
        str(level["vertices"]),
        vertices or NONE,
        str(level["faces"]),
        polygons or NONE,
        str(level["parts"]),
        cell(level["chamfer_mm"], "{:.2f}"),
        seconds_text(level["seconds"]),
    ]
