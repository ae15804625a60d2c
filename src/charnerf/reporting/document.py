"""A report as a list of blocks, written as Markdown (pictures linked) and as one HTML file (pictures inside)."""

import base64
import html
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from pathlib import Path
from typing import Any

from charnerf.files import write_text
from charnerf.markdown import code_block, escaped, table
from charnerf.pictures import open_picture

STILL = (
    "The diagrams of report.html are still pictures, because plotly is not installed. For ones to point at and zoom: "
    "pip install 'charnerf[report]' (in a clone: pip install -e '.[report]'), then `charnerf report` again."
)
_STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1d1f23; background: #fff; max-width: 1320px;
       margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: .3rem; } h2 { font-size: 1.25rem; margin-top: 2.2rem; }
p.lead { font-size: 1.1rem; }
table { border-collapse: collapse; margin: .8rem 0; font-variant-numeric: tabular-nums;
        display: block; overflow-x: auto; font-size: .88rem; }
th, td { padding: .3rem .5rem; text-align: right; border-bottom: 1px solid #e3e5e8; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 2px solid #9aa0a8; font-weight: 600; }
tbody tr:first-child td { font-weight: 600; }
table.plain tbody tr:first-child td { font-weight: 400; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; }
figcaption { color: #5c626b; font-size: .9rem; }
pre { background: #f5f6f8; padding: .8rem 1rem; overflow-x: auto; border-radius: 4px; font-size: .85rem; }
details summary { cursor: pointer; color: #3a5a8c; }
"""


@dataclass(frozen=True)
class Heading:
    """A title of level 1 or 2."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Text:
    """A paragraph; the lead says the result in one breath."""

    text: str
    lead: bool = False


@dataclass(frozen=True)
class Bullets:
    """A list of short facts."""

    items: Sequence[str]


@dataclass(frozen=True)
class Code:
    """Lines to type or to keep; `folded` under a title."""

    text: str
    folded: str | None = None


@dataclass(frozen=True)
class Table:
    """Cells as text; the first row may be the one that matters (`emphasis`)."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    emphasis: bool = False


@dataclass(frozen=True)
class Picture:
    """A picture file below the report's folder."""

    path: Path
    caption: str


@dataclass(frozen=True)
class Plot:
    """A diagram that can be pointed at and zoomed.

    Attributes:
        figure: Data and layout as plotly's JSON writes them.
        picture: The same, still: for Markdown, and for HTML where plotly is not installed.
    """

    figure: Mapping[str, Any]
    picture: Picture


Block = Heading | Text | Bullets | Code | Table | Picture | Plot


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
    return "\n".join(f"- {escaped(item)}" for item in block.items)


@_markdown.register
def _(block: Code, folder: Path) -> str:
    title = f"{block.folded}:\n\n" if block.folded else ""
    return title + code_block(block.text)


@_markdown.register
def _(block: Table, folder: Path) -> str:
    return "\n".join(table(block.header, block.rows))


@_markdown.register
def _(block: Picture, folder: Path) -> str:
    link = block.path.relative_to(folder).as_posix().replace(" ", "%20")
    caption = escaped(block.caption)
    return f"![{caption}]({link})\n\n*{caption}*"


@_markdown.register
def _(block: Plot, folder: Path) -> str:
    return _markdown(block.picture, folder)


@singledispatch
def _html(block: Block) -> str:
    """One block as HTML."""
    raise TypeError(type(block).__name__)


@_html.register
def _(block: Heading) -> str:
    return f"<h{block.level}>{html.escape(block.text)}</h{block.level}>"


@_html.register
def _(block: Text) -> str:
    kind = ' class="lead"' if block.lead else ""
    return f"<p{kind}>{html.escape(block.text)}</p>"


@_html.register
def _(block: Bullets) -> str:
    return "<ul>" + "".join(f"<li>{html.escape(item)}</li>" for item in block.items) + "</ul>"


@_html.register
def _(block: Code) -> str:
    inner = f"<pre>{html.escape(block.text.rstrip())}</pre>"
    return (
        f"<details><summary>{html.escape(block.folded)}</summary>{inner}</details>" if block.folded else inner
    )


@_html.register
def _(block: Table) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    rows = "".join(line(row, "td") for row in block.rows)
    kind = "" if block.emphasis else ' class="plain"'
    return f"<table{kind}><thead>{line(block.header, 'th')}</thead><tbody>{rows}</tbody></table>"


@_html.register
def _(block: Picture) -> str:
    caption = html.escape(block.caption)
    picture = f'<img alt="{caption}" src="{_embedded(block.path)}">'
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


@_html.register
def _(block: Plot) -> str:
    figure = json.dumps(block.figure, allow_nan=False).replace("<", "\\u003c")  # no text can end the script
    return (
        f'<figure class="plot"><div></div><script type="application/json">{figure}</script>'
        f"<figcaption>{html.escape(block.picture.caption)}</figcaption></figure>"
    )


_DRAW = """
document.querySelectorAll("figure.plot").forEach(figure => {
  const plot = JSON.parse(figure.querySelector("script").textContent);
  Plotly.newPlot(figure.querySelector("div"), plot.data, plot.layout, {responsive: true, displaylogo: false});
});
"""


def plot_library() -> str | None:
    """The script of plotly, to be embedded; None where the package is not installed."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        return None
    return str(get_plotlyjs())


def _embedded(path: Path) -> str:
    """A picture as a data URL: small files as they are, large ones as JPEG of high quality."""
    content, kind = path.read_bytes(), "png"
    if len(content) > 200_000:
        buffer = io.BytesIO()
        with open_picture(path) as picture:
            picture.convert("RGB").save(buffer, format="JPEG", quality=90, subsampling=0)
        if buffer.tell() < len(content):
            content, kind = buffer.getvalue(), "jpeg"
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def to_markdown(blocks: Sequence[Block], folder: Path) -> str:
    """A report as Markdown, its pictures linked from the folder."""
    return "\n\n".join(_markdown(block, folder) for block in blocks) + "\n"


def to_html(title: str, blocks: Sequence[Block]) -> str:
    """A report as one HTML file that needs nothing else; plots are still pictures where plotly is not installed."""
    library = plot_library() if any(isinstance(block, Plot) for block in blocks) else None
    if library is None:
        blocks = [block.picture if isinstance(block, Plot) else block for block in blocks]
    body = "\n".join(_html(block) for block in blocks)
    scripts = "" if library is None else f"<script>{library}</script>\n<script>{_DRAW}</script>\n"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n{scripts}</body>\n</html>\n"
    )


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
