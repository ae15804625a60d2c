"""A report on disk: report.md, its pictures linked, and report.html, which needs no other file."""

from collections.abc import Sequence
from functools import singledispatch
from pathlib import Path

from charnerf.files import write_text
from charnerf.markdown import code_block, escaped, table
from charnerf.reporting.blocks import (
    Block,
    Bullets,
    Code,
    Files,
    Film,
    Heading,
    Mesh,
    Picture,
    Plot,
    SideBySide,
    Table,
    Text,
    link,
)
from charnerf.reporting.page import plot_library, to_html

STILL = (
    "The diagrams of report.html are still pictures, because plotly is not installed. For ones to point at and zoom: "
    "pip install 'charnerf[report]' (in a clone: pip install -e '.[report]'), then `charnerf report` again."
)


@singledispatch
def _markdown(block: Block, folder: Path) -> str:
    """One block as Markdown."""
    raise TypeError(type(block).__name__)


@_markdown.register
def _(block: Heading, folder: Path) -> str:
    return f"{'#' * block.level} {escaped(block.text)}"


@_markdown.register
def _(block: Text, folder: Path) -> str:
    return block.text.replace("<", "&lt;")


@_markdown.register
def _(block: Bullets, folder: Path) -> str:
    mark = "**warning**: " if block.warnings else ""
    return "\n".join(f"- {mark}{escaped(item)}" for item in block.items)


@_markdown.register
def _(block: Code, folder: Path) -> str:
    title = f"{block.folded}:\n\n" if block.folded else ""
    return title + code_block(block.text)


@_markdown.register
def _(block: Table, folder: Path) -> str:
    return "\n".join(table(block.header, block.rows))


@_markdown.register
def _(block: Picture, folder: Path) -> str:
    caption = escaped(block.caption)
    return f"![{caption}]({link(block.path.relative_to(folder))})\n\n*{caption}*"


@_markdown.register
def _(block: Film | Mesh, folder: Path) -> str:
    return f"[{escaped(block.caption)}]({link(block.path.relative_to(folder))})"


@_markdown.register
def _(block: SideBySide, folder: Path) -> str:
    return "\n\n".join(_markdown(item, folder) for item in block.items)


@_markdown.register
def _(block: Files, folder: Path) -> str:
    return "\n".join(f"- [{escaped(name)}]({link(name)}): {escaped(what)}" for name, what in block.entries)


@_markdown.register
def _(block: Plot, folder: Path) -> str:
    return _markdown(block.picture, folder)


def to_markdown(blocks: Sequence[Block], folder: Path) -> str:
    """A report as Markdown, its pictures linked from the folder."""
    return "\n\n".join(_markdown(block, folder) for block in blocks) + "\n"


def write_report(folder: Path, title: str, blocks: Sequence[Block]) -> Path:
    """Write report.html and report.md; says so where plots stay still because plotly is not installed.

    Returns:
        The Markdown file.
    """
    if any(isinstance(block, Plot) for block in blocks) and plot_library() is None:
        blocks = [*blocks, Text(STILL)]
    write_text(folder / "report.html", to_html(title, blocks))
    write_text(folder / "report.md", to_markdown(blocks, folder))
    return folder / "report.md"
