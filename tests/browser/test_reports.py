"""The reports in a real browser: of a reconstruction, of a run and of a grid, each alone in a folder."""

import io
import json
import shutil
import struct
from itertools import pairwise

import numpy as np
import pytest
import trimesh
import yaml
from PIL import Image

from charnerf.drawings.viewpoints import turnaround
from charnerf.evaluation.evaluate import evaluate
from charnerf.evaluation.metrics_file import write_metrics
from charnerf.meshing.export import save_mesh
from charnerf.reconstruction.folder import reconstruct
from charnerf.reporting.blocks import Mesh
from charnerf.reporting.folder_report import write_folder_report
from charnerf.reporting.page import to_html
from charnerf.reporting.run_report import write_run_report
from support.egg_model import OPTIONS, FakeModel, draw_eggs
from support.figures import HullModel, HullRenderer, write_figure

pytestmark = pytest.mark.browser
KINDS = ("reconstruction", "run", "grid")
CURVE = (
    "step,phase,seconds,rays,val_psnr,val_psnr_foreground,val_ssim\n0,0,0,0,12,5,0.7\n90,0,20,9,20,14,0.85\n"
)


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """report.html by kind, moved away from all that it was made of."""
    made, alone = tmp_path_factory.mktemp("made"), tmp_path_factory.mktemp("alone")
    reconstruct(FakeModel(), made / "reconstruction", OPTIONS, turnaround(**draw_eggs(made)))
    write_figure(made / "dataset", "a_very_long_name_of_a_doll" * 3, "doll", num_views=5)
    run = made / "run"
    found = evaluate(
        HullModel(), HullRenderer(), made / "dataset", "test", views=2, output=run, train_seconds=21.0
    )
    write_metrics(run / "metrics.json", found)
    (run / "curve.csv").write_text(CURVE)
    (run / "meshes").mkdir()
    save_mesh(_painted(), run / "meshes" / "doll.glb")
    shutil.copy(made / "reconstruction" / "sheet.png", run / "meshes" / "doll_sheet.png")
    for experiment in ("no_mha", "charnerf"):
        cell = made / "grid" / experiment
        shutil.copytree(run, cell)
        (cell / "config.yaml").write_text(yaml.safe_dump({"name": experiment, "seed": 0}))
        (cell / ".hydra").mkdir()
        overrides = [
            f"experiment={experiment}",
            "data.root=/a/very/long/path/without/any/spaces" + "/to/break/at" * 9,
        ]
        (cell / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump(overrides))
    write_run_report(run)
    write_folder_report(made / "grid")
    for kind in KINDS:
        shutil.copy(made / kind / "report.html", alone / f"{kind}.html")
    shutil.rmtree(made)
    return {kind: alone / f"{kind}.html" for kind in KINDS}


def _painted() -> trimesh.Trimesh:
    """A ball with colors at its vertices, as runs write meshes."""
    ball = trimesh.creation.icosphere(subdivisions=3).apply_translation((0, 0, 1))
    colors = np.full((len(ball.vertices), 4), 255, np.uint8)
    colors[:, :3] = np.round(255 * (0.5 + 0.5 * ball.vertex_normals))
    ball.visual = trimesh.visual.ColorVisuals(ball, vertex_colors=colors)
    return ball


def drawn(page) -> np.ndarray:
    """Pixels of the first mesh's canvas as they are on the screen."""
    canvas = page.locator("charnerf-mesh canvas").first
    canvas.wait_for()
    page.wait_for_timeout(300)
    with Image.open(io.BytesIO(canvas.screenshot())) as picture:
        return np.asarray(picture.convert("RGB")).astype(float)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("kind", KINDS)
def test_a_report_reads_well_and_asks_the_net_for_nothing(reports, open_page, kind, width, scheme):
    opened = open_page(reports[kind], width=width, color_scheme=scheme, offline=True)
    opened.page.locator("charnerf-mesh").first.scroll_into_view_if_needed()
    pixels = drawn(opened.page)
    assert pixels.std() > 5.0, "the mesh is not drawn"
    assert (pixels[0, 0].mean() < 64) == (scheme == "dark")
    assert not opened.is_wider_than_its_window()
    assert opened.serious_findings() == []
    assert opened.complaints == [] and opened.requests == []


def test_a_mesh_is_not_loaded_before_it_is_near(reports, open_page):
    page = open_page(reports["grid"]).page
    page.wait_for_timeout(200)
    assert page.evaluate("customElements.get('charnerf-mesh') === undefined")
    page.locator("charnerf-mesh").first.scroll_into_view_if_needed()
    assert drawn(page).std() > 5.0
    page.evaluate("scrollTo(0, 0)")
    for _ in range(200):  # what playwright waits by, the page's policy forbids
        if page.evaluate("!document.querySelector('charnerf-mesh').renderer"):
            break
        page.wait_for_timeout(50)
    assert page.evaluate("!document.querySelector('charnerf-mesh').renderer")  # the GPU is given back


def test_a_mesh_turns_and_changes_from_the_keyboard(reports, open_page):
    page = open_page(reports["run"], reduced_motion="reduce").page
    page.locator("charnerf-mesh").scroll_into_view_if_needed()
    start = drawn(page)
    assert page.get_by_role("button", name="Turning").get_attribute("aria-pressed") == "false"
    np.testing.assert_array_equal(drawn(page), start)  # motion is not wanted
    page.locator("charnerf-mesh canvas").focus()
    focused = drawn(page)
    seen = [focused]
    for key in ("ArrowLeft", "ArrowUp", "+", "Home"):
        page.keyboard.press(key)
        seen.append(drawn(page))
    assert all(np.abs(one - other).mean() > 0.2 for one, other in pairwise(seen))
    np.testing.assert_allclose(seen[-1], focused, atol=40)
    for name in ("Clay", "Wireframe"):
        page.get_by_role("button", name=name).focus()
        page.keyboard.press("Enter")
        seen.append(drawn(page))
        assert np.abs(seen[-1] - seen[-2]).mean() > 1.0
    page.get_by_role("button", name="Turning").press("Space")
    moving = drawn(page)
    page.wait_for_timeout(400)
    assert np.abs(drawn(page) - moving).mean() > 0.2


def test_print_has_pictures_in_place_of_what_moves(reports, open_page):
    page = open_page(reports["reconstruction"], color_scheme="dark").page
    page.emulate_media(media="print")
    assert not page.locator("charnerf-mesh").is_visible() and not page.locator("video").is_visible()
    assert page.locator("figure img").first.is_visible()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"


def test_where_nothing_draws_in_3d_it_is_said(reports, open_page):
    opened = open_page("about:blank")
    opened.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    opened.page.goto(reports["run"].as_uri())
    opened.page.locator("charnerf-mesh").scroll_into_view_if_needed()
    opened.page.get_by_text("This browser shows no 3D").wait_for()


def test_a_strangers_mesh_calls_nobody(tmp_path, open_page):
    """Its picture lies on another machine, so it says: it is drawn without."""
    header = json.loads(save_mesh(_painted(), tmp_path / "ball.gltf").read_text())
    header["images"] = [{"uri": "http://127.0.0.1:9/spy.png"}]
    header["textures"] = [{"source": 0}]
    header["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunk = struct.pack("<II", len(text), 0x4E4F534A) + text  # one chunk: its buffers are data addresses
    (tmp_path / "ball.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk)
    (tmp_path / "report.html").write_text(to_html("a mesh", [Mesh(tmp_path / "ball.glb", "a mesh")]))
    opened = open_page(tmp_path / "report.html")
    assert drawn(opened.page).std() > 5.0
    assert opened.requests == []
