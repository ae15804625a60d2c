"""What `charnerf check` measured: the kernels with the usual formulas beside them, and a trained field."""

from collections.abc import Sequence
from typing import Any

from docs.figures.sources import markdown, read

TRAINED = "trained field"


def kernels(file: str) -> str:
    """Largest errors of every kernel over its cases, ours and the usual formula's."""
    by_kernel: dict[str, list[dict[str, Any]]] = {}
    for row in read(file)["rows"]:
        if row["kernel"] != TRAINED:
            by_kernel.setdefault(row["kernel"], []).append(row)
    rows = [
        [
            name,
            len({row["case"] for row in found}),
            _largest(found, "ours", "float32"),
            _largest(found, "ours", "float64"),
            _largest(found, "naive", "float32"),
        ]
        for name, found in by_kernel.items()
    ]
    return markdown(["kernel", "cases", "error, float32", "float64", "the usual formula, float32"], rows)


def _largest(rows: Sequence[dict[str, Any]], formula: str, dtype: str) -> str:
    """The largest error of a formula, or what it broke with."""
    found = [row for row in rows if row["formula"] == formula and row["dtype"] == dtype]
    if any(row["non_finite"] for row in found):
        return "not finite"
    worst = max((row["value_error"] for row in found), default=None)
    return "" if worst is None else f"{worst:.1e}" if worst else "0"


def trained(file: str) -> str:
    """What was measured of a trained field."""
    rows = [row for row in read(file)["rows"] if row["kernel"] == TRAINED]
    return markdown(["", "value"], [[row["case"], f"{row['value_error']:.2g}"] for row in rows])
