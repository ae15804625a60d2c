"""What a report shows, as Markdown and as one file of HTML."""

import re

import pytest
import trimesh
from PIL import Image

from charnerf.meshing.export import save_mesh
from charnerf.reporting import page
from charnerf.reporting.blocks import Bullets, Files, Film, Heading, Mesh, Picture, SideBySide, Table, Text
from charnerf.reporting.document import to_markdown
from charnerf.reporting.meshes import run_meshes
from charnerf.reporting.page import to_html


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "meshes").mkdir()
    save_mesh(trimesh.creation.icosphere(subdivisions=1), tmp_path / "meshes" / "a (1).glb")
    Image.new("RGB", (8, 8), "red").save(tmp_path / "meshes" / "a (1)_sheet.png")
    (tmp_path / "turn.mp4").write_bytes(b"film")
    return tmp_path


def test_meshes_films_and_files_are_linked_in_markdown_and_inside_of_html(folder):
    mesh, film = folder / "meshes" / "a (1).glb", folder / "turn.mp4"
    picture = Picture(folder / "meshes" / "a (1)_sheet.png", "wide")
    blocks = [
        SideBySide([Mesh(mesh, "A <b>"), picture]),
        Film(film, "all around", picture.path),
        Files([("a b.txt", "notes")]),
    ]
    text = to_markdown(blocks, folder)
    assert "[A &lt;b>](meshes/a%20%281%29.glb)" in text and "[all around](turn.mp4)" in text
    assert "- [a b.txt](a%20b.txt): notes" in text
    html = to_html("title", blocks)
    assert html.count("<charnerf-mesh ") == 1 and html.count('id="mesh-viewer"') == 1
    assert 'src="data:video/mp4;base64,' in html
    assert '<a href="a%20b.txt">a b.txt</a>: notes' in html
    assert "mesh-viewer" not in re.sub(
        "<script.*?</script>", "", to_html("title", [Text("no mesh")]), flags=re.DOTALL
    )
    assert "<script" not in to_html("title", [Text("no mesh")])


def test_a_mesh_that_is_too_large_for_a_page_is_named(folder, monkeypatch):
    monkeypatch.setattr(page, "MOST_MESH", 10)
    html = to_html("title", [Mesh(folder / "meshes" / "a (1).glb", "A")])
    assert "<charnerf-mesh" not in html and "too large to stand in this page" in html


def test_a_gif_is_a_picture_and_warnings_stand_out(folder):
    (folder / "turn.gif").write_bytes(b"GIF89a")
    html = to_html(
        "title", [Film(folder / "turn.gif", "around", folder / "turn.gif"), Bullets(["x < y"], warnings=True)]
    )
    assert 'src="data:image/gif;base64,' in html and '<li class="warning">x &lt; y</li>' in html
    assert to_markdown([Bullets(["x"], warnings=True)], folder) == "- **warning**: x\n"


def test_wide_tables_scroll_inside_from_the_keyboard():
    html = to_html("title", [Table(["row", "PSNR"], [["a", "1"]], emphasis=True)])
    assert (
        '<div class="scroll" tabindex="0" role="group" aria-label="table: row, PSNR"><table class="emphasis">'
        in html
    )


def test_a_runs_meshes_come_with_their_sheets_and_without_levels_of_detail(folder):
    save_mesh(trimesh.creation.icosphere(subdivisions=1), folder / "meshes" / "a_LOD0.glb")
    heading, mesh, sheet = run_meshes(folder)
    assert heading == Heading("The mesh")
    assert mesh.path.name == "a (1).glb" and sheet.path.name == "a (1)_sheet.png"
    assert run_meshes(folder / "meshes") == []
