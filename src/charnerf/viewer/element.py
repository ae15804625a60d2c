"""The mesh viewer as HTML: its element and its script."""

import base64
import html
from functools import cache
from importlib.resources import files


@cache
def viewer_script() -> str:
    """The script that makes `<charnerf-mesh>` work; it stands inside of a page as it is and asks for nothing."""
    return files("charnerf.viewer").joinpath("mesh_viewer.min.js").read_text(encoding="utf-8")


def mesh_element(label: str, *, source: bytes | str) -> str:
    """The element that shows a mesh.

    Args:
        label: What it shows, for those who listen to the page.
        source: A GLB's content, which the element then holds itself, or its address.
    """
    if isinstance(source, str):
        return f'<charnerf-mesh label="{html.escape(label)}" src="{html.escape(source)}"></charnerf-mesh>'
    content = base64.b64encode(source).decode("ascii")
    return f'<charnerf-mesh label="{html.escape(label)}"><script type="text/plain">{content}</script></charnerf-mesh>'
