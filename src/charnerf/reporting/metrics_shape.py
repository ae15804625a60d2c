"""What a metrics.json has to look like before a report reads it: by key, so that an error names the file and the key."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from charnerf.data.layout import check_name
from charnerf.errors import DataError
from charnerf.evaluation.ahead import AHEAD_KEYS
from charnerf.evaluation.scores import METRIC_KEYS

_LARGEST = 1e30  # of any number
_NUMBERS = (*METRIC_KEYS, "num_characters", "num_views", "peak_memory_mib")
_TEXTS = ("split", "data_root")
_ROWS = ("by_azimuth", "by_elevation", "by_source_angle")  # lists of figures
_FIGURES = ("seconds", "left_out", "peak_memory_by_stage_mib")
_TABLES = ("per_character", "baselines")  # figures by name


def check_metrics(metrics: Mapping[str, Any], file: Path) -> None:
    """Check the kinds of a metrics.json's values.

    Raises:
        DataError: Names the first that is another.
    """
    for name in _TABLES:
        for one, figures in _object(metrics.get(name, {}), f"{file}: {name}").items():
            where = f"{file}: {name}.{one[:60]}"
            _check_scores(_object(figures, where), where)
            if name == "per_character":
                check_name(f"{file}: per_character:", one)
                if missing := [key for key in METRIC_KEYS if key not in figures]:
                    raise DataError(f"{where}: lacks {', '.join(missing)}; evaluate again.")
            else:
                _check_names(figures.get("ahead", {}), f"{where}: ahead")
    _check_scores(_object(metrics.get("drawings", {}), f"{file}: drawings"), f"{file}: drawings")
    _object(metrics.get("environment", {}), f"{file}: environment")
    _check_scores({key: value for key, value in metrics.items() if key not in _TABLES}, str(file))


def _check_names(value: Any, where: str) -> None:
    """Check lists of characters by metric."""
    for key, names in _object(value, where).items():
        if key not in AHEAD_KEYS or not (
            isinstance(names, list) and all(isinstance(one, str) for one in names)
        ):
            raise DataError(
                f"{where}.{key[:60]}: found {str(names)[:60]}, expected one of {', '.join(AHEAD_KEYS)} and a list of names;"
                " evaluate again."
            )
        for name in names:
            check_name(f"{where}.{key}:", name)


def _check_scores(figures: Mapping[str, Any], where: str) -> None:
    """Check figures of a method or a character, with their rows by angle."""
    for key, value in figures.items():
        place = f"{where}: {key[:60]}"
        if key in _NUMBERS or key.endswith("_deg"):
            _check_number(value, place)
        elif (key in _TEXTS or key.endswith("_reason")) and not isinstance(value, str | None):
            raise DataError(f"{place}: found {str(value)[:60]}, expected a text; evaluate again.")
        elif key in _ROWS:
            if not isinstance(value, list):
                raise DataError(f"{place}: found {str(value)[:60]}, expected a list; evaluate again.")
            for index, row in enumerate(value):
                _check_figures(row, f"{place}.{index}")
        elif key in _FIGURES:
            _check_figures(value, place)


def _check_figures(value: Any, where: str) -> None:
    for key, one in _object(value, where).items():
        if key.endswith("_reason") and isinstance(one, str | None):
            continue
        _check_number(one, f"{where}.{key[:60]}")


def _check_number(value: Any, where: str) -> None:
    if value is None or (type(value) in (int, float) and abs(value) < _LARGEST):
        return
    raise DataError(f"{where}: found {str(value)[:60]}, expected a number or null; evaluate again.")


def _object(value: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise DataError(f"{where}: found {str(value)[:60]}, expected an object; evaluate again.")
    return value
