"""Tables in Markdown, and texts in it that come from elsewhere."""

import re
from collections.abc import Iterable, Sequence


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table: its first column is aligned to the left, the figures after it to the right.

    Args:
        heads: Titles of the columns.
        rows: Cells, as many as titles; bars, HTML and ends of lines in a cell are escaped.
    """
    rule = ["---"] + ["---:"] * (len(heads) - 1)
    return [_line(heads), "| " + " | ".join(rule) + " |", *map(_line, rows)]


def escaped(text: str) -> str:
    """A text on one line that holds no HTML: names of runs, characters and files may hold anything."""
    return " ".join(text.splitlines()).replace("<", "&lt;")


def code_block(text: str) -> str:
    """A text between fences that it can not end."""
    longest = max(map(len, re.findall("`+", text)), default=0)
    fence = "`" * max(3, longest + 1)
    return f"{fence}\n{text.rstrip()}\n{fence}"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(escaped(cell).replace("|", "\\|") for cell in cells) + " |"
