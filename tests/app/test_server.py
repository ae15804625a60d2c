"""The page's server: from drawings to files, corrections, the queue, and what it refuses."""

import asyncio
import io
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import trimesh
from PIL import Image

from support.app_server import QUICK, app_server
from support.egg_model import draw_eggs


@pytest.fixture
def eggs(tmp_path):
    """Front, side and back of the egg."""
    folder = tmp_path / "drawn"
    folder.mkdir()
    return list(draw_eggs(folder).values())


@pytest.fixture
def work(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    return folder


def test_three_drawings_become_files_and_a_field_to_look_at(work, eggs):
    async def story():
        async with app_server(work) as (_, open_page):
            page = await open_page()
            assert [status for status, _ in await page.give(*eggs)] == [200] * 3
            state = await page.read()
            assert [one["view"] for one in state["figures"]] == ["front", "left", "back"]
            assert [one["tone"] for one in state["read"]["views"]] == ["good"] * 3
            assert str(work) not in str(state) and "--" not in str(state)
            panel = await page.ask(
                "GET", f"read/{state['read']['folder']}/{state['read']['views'][0]['given']}"
            )
            assert panel[0] == 200 and Image.open(io.BytesIO(panel[1])).size == (320, 320)
            assert (await page.ask("POST", "build", json={**QUICK, "levels": "300"}))[0] == 200
            product = (await page.finished())["product"]
            assert page.state["job"]["state"] == "done" and product["can_look"]
            contents = {
                name: (await page.ask("GET", f"made/{product['folder']}/{name}"))[1]
                for name in product["files"]
            }
            looks = [
                (await page.ask("GET", f"look?azimuth={azimuth}&elevation=0&size=64&moving"))[1]
                for azimuth in (0, 180)
            ]
            return product, contents, looks

    product, contents, looks = asyncio.run(story())
    assert {
        "mesh.glb",
        "mesh_obj.zip",
        "mesh.usdz",
        "levels.zip",
        "sheet.png",
        "report.html",
    } < contents.keys()
    assert [level["faces"] for level in product["levels"]] == [600, 300]
    mesh = trimesh.load(io.BytesIO(contents["mesh.glb"]), file_type="glb", force="mesh")
    assert mesh.is_watertight or len(mesh.faces) == 600
    assert sorted(zipfile.ZipFile(io.BytesIO(contents["mesh_obj.zip"])).namelist()) == [
        "mesh.mtl",
        "mesh.obj",
        "mesh.png",
    ]
    assert zipfile.ZipFile(io.BytesIO(contents["levels.zip"])).namelist() == [
        "mesh_LOD0.glb",
        "mesh_LOD1.glb",
    ]
    front, back = (np.asarray(Image.open(io.BytesIO(one)))[32, 32] for one in looks)
    assert front[0] > 200 > front[1] and back[1] > 150 > back[0]  # red in front, green behind


def test_names_are_corrected_and_figures_left_out(work, eggs):
    async def story():
        async with app_server(work) as (_, open_page):
            page = await open_page()
            await page.give(*eggs)
            _, side, back = (await page.read())["figures"]

            async def edit(figure, view, mirrored=False):
                changes = {str(figure["number"]): {"view": view, "mirrored": mirrored}}
                before = page.state["revision"]
                assert (await page.ask("POST", "figures", json={"figures": changes}))[0] == 200
                return await page.wait(lambda state: state["revision"] > before and not state["busy"])

            assert "right" in str((await edit(side, "right", True))["read"]["assumptions"])
            state = await edit(back, "front")
            assert state["read"] is None and "Two figures are called front" in state["problem"]
            assert (await page.ask("POST", "build", json=QUICK))[0] == 400
            state = await edit(back, "")
            assert state["problem"] is None and len(state["read"]["views"]) == 2
            assert "one view" in (await edit(side, ""))["problem"]
            assert [one["view"] for one in (await edit(side, "45,20"))["read"]["views"]] == [
                "front",
                "45,20 degrees",
            ]

    asyncio.run(story())


def test_the_server_computes_nothing_itself():
    code = "import sys, charnerf.app.server; print('torch' in sys.modules, 'scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["False", "False"]
