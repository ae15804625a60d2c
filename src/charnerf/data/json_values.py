"""Numbers and sections of a camera file, checked: a message names file and key, what was found and what was expected."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from charnerf.errors import DataError

MOST_PIXELS = 16_384  # a side
MOST_VALUES = 10_000_000  # of a file; one takes up to 100 bytes of memory
_LARGEST = 1e30  # of any number of a camera


def check_commas(found: int, where: str) -> None:
    """Check before it is parsed that a JSON text means no more than memory holds: `[],` is three bytes on the disk.

    Raises:
        DataError: If it has more commas than values are allowed.
    """
    if found > MOST_VALUES:
        raise DataError(f"{where}: found {found} values, expected at most {MOST_VALUES}.")


def count(where: str, values: Mapping[str, Any], key: str) -> int:
    """A number of pixels.

    Raises:
        DataError: If it is missing, no whole number, or out of bounds.
    """
    value = values.get(key)
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MOST_PIXELS:
        raise DataError(
            f"{where}.{key}: found {shown(value)}, expected a number of pixels, 1 or more, at most {MOST_PIXELS}."
        )
    return value


def number(where: str, values: Mapping[str, Any], key: str, default: float | None) -> float:
    """A finite number; the default where the key is missing, if there is one.

    Raises:
        DataError: If it is none.
    """
    value = values.get(key, default)
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) < _LARGEST:
        raise DataError(f"{where}.{key}: found {shown(value)}, expected a finite number.")
    return float(value)


def section(path: Path, key: str, value: Any) -> dict[str, Any]:
    """An object of a file.

    Raises:
        DataError: If it is something else.
    """
    if not isinstance(value, dict):
        raise DataError(f"{path}: {key}: found {shown(value)}, expected an object.")
    return value


def shown(value: Any) -> str:
    """A value as messages show it, shortened."""
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
