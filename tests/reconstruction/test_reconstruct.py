"""A reconstruction's folder: whole, complete, measured; a fake network answers in place of a trained one."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import imageio.v3 as iio
import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from charnerf.drawings.read_sheet import read_sheet
from charnerf.drawings.viewpoints import turnaround
from charnerf.errors import DataError, NumericalError
from charnerf.geometry.bounds import Bounds
from charnerf.geometry.hull import build_hull
from charnerf.meshing.exported import read_texture
from charnerf.reconstruction.folder import Reconstruction, reconstruct
from support.egg_model import BOX, MESH, OPTIONS, FakeModel, draw_eggs


@pytest.fixture
def drawings(tmp_path) -> dict[str, Path]:
    return draw_eggs(tmp_path)


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Reconstruction:
    """The egg's, in a folder that is only read."""
    folder = tmp_path_factory.mktemp("egg")
    return reconstruct(FakeModel(), folder / "out", OPTIONS, turnaround(**draw_eggs(folder)))


def test_folder_is_complete_and_true_to_the_field(done):
    out = done.mesh.parent
    names = sorted(path.name for path in out.iterdir())
    assert names == [
        "drawings.png",
        "mesh.glb",
        "meshes",
        "report.html",
        "report.json",
        "report.md",
        "sheet.png",
        done.turntable.name,
        "views",
    ]
    assert Image.open(out / "sheet.png").size == (8 * 48, 2 * (48 + 20) + 12)
    assert Image.open(out / "meshes" / "mesh_sheet.png").width > 1000
    assert sorted(v.name for v in done.views) == [f"{60 * k:03d}.png" for k in range(6)]
    mesh = trimesh.load(done.mesh, force="mesh", process=False)
    np.testing.assert_allclose(mesh.bounds[:, 1], (0.0, 2.0), atol=1e-6)  # Y up
    assert mesh.extents[0] == pytest.approx(1.0, abs=0.06)
    assert len(mesh.faces) <= 600
    front = np.asarray(Image.open(out / "views" / "000.png"))[24, 24]
    back = np.asarray(Image.open(out / "views" / "180.png"))[24, 24]
    assert front[0] > 200 and front[1] < 60 and front[3] > 240
    assert back[1] > 180 and back[0] < 60
    assert iio.imread(done.turntable).shape == (6, 48, 48, 3)


def test_the_mesh_wears_the_drawings(done, tmp_path, drawings):
    """The field is red in front and green behind; the side drawing is orange, which the field never is."""
    mesh = trimesh.load(done.mesh, force="mesh", process=False)
    uv = np.asarray(mesh.visual.uv)
    colors = read_texture(mesh.visual.material.baseColorTexture, uv)
    left = mesh.vertices[:, 0] > 0.45  # Y up: x stays the character's left
    assert left.any()
    np.testing.assert_allclose(np.median(colors[left], axis=0), (1.0, 165 / 255, 0.0), atol=0.02)
    in_vertices = replace(OPTIONS, mesh=replace(MESH, texture="vertex"))
    plain = reconstruct(FakeModel(), tmp_path / "plain", in_vertices, turnaround(**drawings))
    assert trimesh.load(plain.mesh, force="mesh").visual.material.baseColorTexture is None


def test_report_says_what_was_assumed_made_and_how_long(done):
    text = done.report.with_suffix(".md").read_text()
    for words in (
        "floor line",
        "left side",
        "grid's points were left out",
        "% of the light is gone on the clearest way in; Euler number",
        "| encode |",
        "weights.safet",
    ):
        assert words in text
    facts = json.loads((done.report.with_suffix(".json")).read_text())
    assert (
        facts["quality"] == json.loads(json.dumps(done.quality.facts()))
        and facts["seconds"].keys() == done.seconds.keys()
    )
    assert min(one.given for one in done.quality.silhouettes) > 0.93  # the field is the drawn egg
    assert (done.quality.parts, done.quality.is_closed, done.quality.handles) == (1, True, 0)
    for line in text.splitlines():  # every file shown is there
        for part in line.split("](")[1:]:
            assert (done.report.parent / part.split(")")[0]).exists()


def test_what_was_said_of_the_sheet_is_told_in_the_report_too(tmp_path, drawings):
    page = Image.fromarray(
        np.concatenate([np.asarray(Image.open(file)) for file in drawings.values()], axis=1)
    )
    page.save(tmp_path / "page.png")
    read = replace(read_sheet(tmp_path / "page.png"), warnings=("Figure 2 is a sword: leave it out.",))
    done = reconstruct(FakeModel(), tmp_path / "out", OPTIONS, read.drawings, sheet=read)
    text = done.report.with_suffix(".md").read_text()
    assert all(line in text for line in (*read.assumptions, *read.warnings))
    facts = json.loads((tmp_path / "out" / "report.json").read_text())
    assert facts["warnings"] == list(done.warnings) and done.warnings[0] == read.warnings[0]


def test_a_second_run_replaces_its_pieces_and_nothing_else(tmp_path, drawings):
    output = tmp_path / "out"
    output.mkdir()
    (output / "notes.txt").write_text("mine")
    (output / "turntable.gif").write_text("old")
    (output / "views").mkdir()
    (output / "views" / "007.png").write_text("old")
    reconstruct(FakeModel(), output, OPTIONS, turnaround(**drawings))
    assert (output / "notes.txt").read_text() == "mine"
    assert not (output / "views" / "007.png").exists()
    assert len(list(output.glob("turntable.*"))) == 1
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_nothing_is_left_of_a_failure(tmp_path, drawings):
    with pytest.raises(NumericalError, match="The field is empty"):
        reconstruct(FakeModel(density=0.0), tmp_path / "out", OPTIONS, turnaround(**drawings))
    with pytest.raises(DataError, match=r"gone\.png"):
        reconstruct(
            FakeModel(), tmp_path / "out", OPTIONS, turnaround(**{**drawings, "side": tmp_path / "gone.png"})
        )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["back.png", "front.png", "side.png"]
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="found a file, expected a folder"):
        reconstruct(FakeModel(), tmp_path / "file", OPTIONS, turnaround(**drawings))


def test_without_an_encoder_the_turntable_is_a_gif(tmp_path, monkeypatch):
    from charnerf.reconstruction import turntable

    def refuses(*arguments, **options):
        raise ImportError("no ffmpeg")

    monkeypatch.setattr(turntable, "iio", SimpleNamespace(imwrite=refuses))
    frames = [np.full((20, 20, 3), 60 * k, np.uint8) for k in range(4)]
    path, note = turntable.write_film(frames, tmp_path)
    assert path.name == "turntable.gif" and "no ffmpeg" in note
    assert Image.open(path).n_frames == 4


def test_pictures_frame_the_figure_and_not_its_limits(drawings):
    """Where views only colour, the hull is the whole space: pictures are framed as the drawings frame the figure all the same."""
    hero = FakeModel().encode_drawings(turnaround(*drawings.values()))
    wide = replace(hero.views, widened_alphas=torch.ones_like(hero.views.carving_alphas))
    hull = build_hull(wide, box_min=BOX[0], box_max=BOX[1], grid_size=32)[0]
    loose = replace(hero, scene=replace(hero.scene, bounds=Bounds(*BOX, hull)))
    assert hero.turnaround.half_extent == pytest.approx(1.05, abs=0.02)
    assert loose.radius() == pytest.approx(hero.turnaround.half_extent, abs=1e-4)
    assert hero.radius() <= loose.radius()
