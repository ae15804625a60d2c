"""Results as plain text and Markdown tables."""

from collections.abc import Mapping, Sequence
from typing import Any


def markdown(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table; numbers get three significant digits."""
    cells = [[_shown(value) for value in row] for row in rows]
    widths = [
        max(len(name), *(len(row[i]) for row in cells)) if cells else len(name)
        for i, name in enumerate(header)
    ]
    lines = [header, ["-" * width for width in widths], *cells]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in lines
    )


def _shown(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def rows_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """A table of mappings with the same keys."""
    return markdown([name.replace("_", " ") for name in rows[0]], [tuple(row.values()) for row in rows])


def headline_table(headline: Mapping[str, Any]) -> str:
    """The headline, one row a number."""
    return markdown(
        ("headline", "value"), [(name, value) for name, value in headline.items() if name != "how"]
    )


def comparison_table(comparisons: Sequence[Mapping[str, Any]]) -> str:
    """Methods on subjects: rays a second, speed-up, errors, what is left."""
    rows = []
    for one in comparisons:
        for name, found in one["methods"].items():
            shares = found.get("left_out", {})
            left = shares.get("samples")
            tolerance = found.get("tolerance", {})
            rows.append(
                (
                    one["name"],
                    name,
                    found["rays_per_second"],
                    one["speedup"].get(name, 1.0),
                    found["psnr"],
                    found["rms_error"],
                    found["max_error"],
                    tolerance.get("estimated"),
                    tolerance.get("asked"),
                    None if left is None else 100.0 * (1.0 - left),
                )
            )
    header = (
        "subject",
        "method",
        "rays/s",
        "speed-up",
        "PSNR dB",
        "rms error",
        "max error",
        "estimated",
        "asked",
        "samples left %",
    )
    return markdown(header, rows)
