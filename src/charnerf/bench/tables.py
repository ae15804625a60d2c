"""Results as Markdown tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from charnerf.markdown import table


def markdown(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table; numbers get three significant digits."""
    return "\n".join(table(header, [[_text(value) for value in row] for row in rows]))


def _text(value: Any) -> str:
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
        for name, measured in one["methods"].items():
            left_out = measured.get("left_out", {}).get("samples")
            tolerance = measured.get("tolerance", {})
            rows.append(
                {
                    "subject": one["name"],
                    "method": name,
                    "rays/s": measured["rays_per_second"],
                    "speed-up": one["speedup"].get(name, 1.0),
                    "PSNR dB": measured["psnr"],
                    "rms error": measured["rms_error"],
                    "max error": measured["max_error"],
                    "estimated": tolerance.get("estimated"),
                    "tolerance": tolerance.get("asked"),
                    "samples left %": None if left_out is None else 100.0 * (1.0 - left_out),
                }
            )
    return rows_table(rows)
