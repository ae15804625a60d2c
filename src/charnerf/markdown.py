"""Tables in Markdown."""

from collections.abc import Iterable, Sequence


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table: its first column is aligned to the left, the figures after it to the right.

    Args:
        heads: Titles of the columns.
        rows: Cells, as many as titles; a bar in a cell is escaped.
    """
    rule = ["---"] + ["---:"] * (len(heads) - 1)
    return [_line(heads), "| " + " | ".join(rule) + " |", *map(_line, rows)]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
