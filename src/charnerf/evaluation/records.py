"""Frozen records of figures, kept as JSON."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from charnerf.data.layout import read_json
from charnerf.errors import DataError
from charnerf.files import write_text

Record = TypeVar("Record")


def write_record(path: Path, record: Any) -> None:
    """Write a dataclass of plain values, whole or not at all."""
    write_text(path, json.dumps(asdict(record)) + "\n")


def read_record(path: Path, kind: type[Record], *, what: str) -> Record:
    """Read a dataclass of plain values; `what` it is called in an error.

    Raises:
        DataError: If the file is missing or holds something else.
    """
    try:
        return kind(**read_json(path))
    except TypeError as error:
        raise DataError(f"{path}: found other keys ({error}), expected {what}; remove the file.") from error
