"""What Tab offers after options whose values lie in a data set; at once, so nothing heavy is imported, and never an error."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import typer

from charnerf.files import read_text


def characters(context: typer.Context) -> list[str]:
    """Names of the characters of the data set that --data names."""
    return sorted({name for names in _splits(context).values() for name in names})


def splits(context: typer.Context) -> list[str]:
    """Its splits."""
    return sorted(_splits(context))


def _splits(context: typer.Context) -> Mapping[str, Sequence[str]]:
    data = context.params.get("data")
    try:
        content = json.loads(read_text(Path(str(data)) / "dataset.json"))
        return {
            str(split): [str(name) for name in names] for split, names in content["splits"].items() if names
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}
