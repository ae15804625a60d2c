"""The viewer's script is the one that its source makes, and asks for nothing; its element holds the mesh."""

import base64
import hashlib
import re
from importlib.resources import files
from pathlib import Path

from charnerf.viewer.element import mesh_element, viewer_script

SOURCE = Path(str(files("charnerf.viewer"))) / "source"


def test_the_script_was_built_from_the_source_that_lies_beside_it():
    digest = hashlib.sha256((SOURCE / "mesh_viewer.js").read_bytes()).hexdigest()
    assert f"sha256 {digest}" in viewer_script()[:300], "rebuild it: npm ci && npm run build in viewer/source"
    assert "MIT License" in files("charnerf.viewer").joinpath("LICENSE-three.txt").read_text(encoding="utf-8")


def test_the_script_can_stand_in_a_page():
    script = viewer_script()
    assert "</script" not in script.lower() and script.isascii()
    namespaces = set(re.findall(r"https?://[\w./-]+", script))
    assert all("www.w3.org" in one or "threejs.org" in one or "github.com" in one for one in namespaces), (
        namespaces
    )
    assert len(script) < 800_000


def test_the_element_holds_the_mesh_or_its_address():
    element = mesh_element('a "hero" <b>', source=b"glTF\x00\xff")
    held = re.search(r'<script type="text/plain">(.*)</script>', element)
    assert held is not None and base64.b64decode(held[1]) == b"glTF\x00\xff"
    assert 'label="a &quot;hero&quot; &lt;b&gt;"' in element
    assert 'src="/file?name=a&amp;b.glb"' in mesh_element("a", source="/file?name=a&b.glb")
