"""A report as one HTML file that needs nothing else: pictures and meshes stand inside, and what draws them."""

import base64
import html
import io
import json
from collections.abc import Iterator, Sequence
from functools import singledispatch
from importlib.resources import files
from pathlib import Path

from charnerf.pictures import open_picture
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
from charnerf.viewer.element import mesh_element, viewer_script

WIDE = 1.6  # width over height of a picture that is more than one
ALONE = (  # whatever a report shows, the browser asks nobody for anything
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; media-src data:;"
    " connect-src data: blob:"
)
MOST_MESH = 16 * 2**20  # bytes of a mesh that stands in a page itself


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
    kind = ' class="warning"' if block.warnings else ""
    return "<ul>" + "".join(f"<li{kind}>{html.escape(item)}</li>" for item in block.items) + "</ul>"


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
    kind = ' class="emphasis"' if block.emphasis else ""
    inner = f"<table{kind}><thead>{line(block.header, 'th')}</thead><tbody>{rows}</tbody></table>"
    # wide tables scroll inside, from the keyboard too
    return (
        f'<div class="scroll" tabindex="0" role="group" aria-label="table: {_columns(block)}">{inner}</div>'
    )


@_html.register
def _(block: Picture) -> str:
    caption = html.escape(block.caption)
    with open_picture(block.path) as picture:
        width, height = picture.size
    shown = f'<img alt="{caption}" width="{width}" height="{height}" src="{_embedded(block.path)}">'
    if width > WIDE * height:  # on a phone it scrolls inside: shrunk, nobody could read it
        shown = f'<div class="scroll wide" tabindex="0" role="group" aria-label="{caption}">{shown}</div>'
    return _figure(shown, caption)


@_html.register
def _(block: Film) -> str:
    caption, content = html.escape(block.caption), block.path.read_bytes()
    if block.path.suffix != ".mp4":
        return _figure(f'<img alt="{caption}" src="{_data_address(content, "image/gif")}">', caption)
    still, source = _embedded(block.still), _data_address(content, "video/mp4")
    video = f'<video controls loop muted playsinline preload="none" poster="{still}" src="{source}"'
    return _figure(f'{video} aria-label="{caption}"></video>', caption)


@_html.register
def _(block: Mesh) -> str:
    caption = html.escape(block.caption)
    size = block.path.stat().st_size
    if size > MOST_MESH:
        return f"<p>{caption}: {size / 2**20:.0f} MiB, too large to stand in this page; it opens in Blender and in viewers.</p>"
    return _figure(mesh_element(block.caption, source=block.path.read_bytes()), caption)


@_html.register
def _(block: SideBySide) -> str:
    is_wide = any(
        isinstance(item, Mesh) or (isinstance(item, Picture) and _is_wide(item)) for item in block.items
    )
    kind = "row broad" if is_wide else "row"
    return f'<div class="{kind}">{"".join(_html(item) for item in block.items)}</div>'


@_html.register
def _(block: Files) -> str:
    return (
        "<ul>"
        + "".join(
            f'<li><a href="{link(name)}">{html.escape(name)}</a>: {html.escape(what)}</li>'
            for name, what in block.entries
        )
        + "</ul>"
    )


@_html.register
def _(block: Plot) -> str:
    figure = json.dumps(block.figure, allow_nan=False).replace("<", "\\u003c")  # no text can end the script
    return (
        f'<figure class="plot"><div></div><script type="application/json">{figure}</script>'
        f"<figcaption>{html.escape(block.picture.caption)}</figcaption></figure>"
    )


def _is_wide(block: Picture) -> bool:
    """Whether a picture is more than one, side by side."""
    with open_picture(block.path) as picture:
        return picture.width > WIDE * picture.height


def _figure(content: str, caption: str) -> str:
    return f"<figure>{content}<figcaption>{caption}</figcaption></figure>"


def _columns(block: Table) -> str:
    """What a table is about, for those who listen: its columns."""
    return html.escape(", ".join(title for title in block.header if title))


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
    return _data_address(content, f"image/{kind}")


def _data_address(content: bytes, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def to_html(title: str, blocks: Sequence[Block], *, refreshes: bool = False) -> str:
    """A report as one HTML file that needs nothing else; plots are still pictures where plotly is not installed.

    Args:
        title: Of the window.
        blocks: What it shows.
        refreshes: Whether it asks the server that it came from for what has changed, see live.js.
    """
    library = plot_library() if any(isinstance(block, Plot) for block in blocks) else None
    scripts = [] if library is None else [f"<script>{library}</script>\n"]
    if any(isinstance(block, Mesh) for block in _each(blocks)):  # inert until page.js begins it
        scripts.append(f'<script type="text/plain" id="mesh-viewer">{viewer_script()}</script>\n')
    if scripts:
        scripts.append(f"<script>{_page_file('page.js')}</script>\n")
    if refreshes:  # first, while diagrams are as they came
        scripts.insert(0, f"<script>{_page_file('live.js')}</script>\n")
    rules = f"{ALONE} 'self'" if refreshes else ALONE
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{rules}">\n'
        f"<title>{html.escape(title)}</title>\n<style>{_page_file('page.css')}</style>\n</head>\n"
        f"<body>\n<main>\n{to_html_blocks(blocks)}\n</main>\n{''.join(scripts)}</body>\n</html>\n"
    )


def to_html_blocks(blocks: Sequence[Block]) -> str:
    """Blocks as HTML, an element each."""
    if plot_library() is None:
        blocks = [block.picture if isinstance(block, Plot) else block for block in blocks]
    return "\n".join(_html(block) for block in blocks)


def _each(blocks: Sequence[Block]) -> Iterator[Block]:
    """All blocks, those in rows too."""
    for block in blocks:
        yield block
        if isinstance(block, SideBySide):
            yield from block.items


def _page_file(name: str) -> str:
    return files("charnerf.reporting").joinpath(name).read_text(encoding="utf-8")
