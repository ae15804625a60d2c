"""Data sets, drawings and meshes of strangers: nothing outside their folder is read or written, no program starts."""

import base64
import io
import json
import os
import shutil
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import trimesh
from PIL import EpsImagePlugin, Image

import charnerf
from charnerf.capture.meshes import load_scene
from charnerf.cli.commands import run
from charnerf.data.characters import load_character, read_rgba
from charnerf.data.layout import read_dataset, read_json
from charnerf.drawings.load import load_drawing
from charnerf.errors import DataError
from charnerf.pictures import FORMATS, open_picture
from charnerf.reporting.run_files import read_curve, read_metrics, read_views
from charnerf.reporting.runs import read_runs
from charnerf.surfaces.mesh_files import load_surface_mesh, write_surface_mesh
from support.work import little_work

EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 64 64\n%%EndComments\n64 64 scale\n%%EOF\n"


@pytest.fixture(autouse=True)
def _at_once() -> Iterator[None]:
    with little_work():
        yield


@pytest.fixture(autouse=True)
def _no_ghostscript(monkeypatch: pytest.MonkeyPatch) -> None:
    def started(*_: object, **__: object) -> None:
        raise AssertionError("Ghostscript was started")

    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", started)


@pytest.fixture
def data(tmp_path: Path, figure_dataset: Path) -> Path:
    """A data set of one's own to break."""
    return Path(shutil.copytree(figure_dataset, tmp_path / "data"))


def change(file: Path, edit: Callable[[dict], object]) -> None:
    content = json.loads(file.read_text())
    edit(content)
    file.write_text(json.dumps(content))


def huge_png(side: int = 60_000) -> bytes:
    """A PNG of many pixels in few bytes."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", side, side, 8, 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(b"\0" * 1000))
        + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize("key", ["file_path", "depth_file_path"])
@pytest.mark.parametrize(
    "name",
    [
        *("../secret.png", "../../secret.png", "ABSOLUTE", "images/../../secret.png", "link.png"),
        *("deep/secret.png", "../secret", "a\0b.png", "\ud800.png", "x" * 5000 + ".png", "loop.png"),
    ],
)
def test_frames_stay_in_their_folder(key: str, name: str, data: Path) -> None:
    folder, secret = data / "twin", data / "secret.png"
    shutil.copy(folder / "images/000.png", secret)
    shutil.copy(secret, data.parent / "secret.png")
    (folder / "link.png").symlink_to(secret)
    (folder / "deep").symlink_to(data)
    (folder / "loop.png").symlink_to(folder / "loop.png")
    change(
        folder / "transforms.json",
        lambda one: one["frames"][1].update({key: name.replace("ABSOLUTE", str(secret))}),
    )
    with pytest.raises(DataError, match=rf"frames\[1\]\.{key}: found "):
        load_character(data, "twin")


def test_source_views_and_meshes_stay_too(data: Path) -> None:
    folder, outside = data / "twin", data.parent / "outside"
    shutil.copytree(folder, outside)
    change(
        folder / "transforms.json",
        lambda one: one["source_views"]["side"].update(file_path="../lefty/sources/side.png"),
    )
    with pytest.raises(DataError, match=r"source_views\.side\.file_path: found .*leads out"):
        load_character(data, "twin")
    for file in ("transforms.json", "mesh/mesh.obj"):
        shutil.rmtree(folder)
        shutil.copytree(outside, folder)
        (folder / file).unlink()
        (folder / file).symlink_to(outside / file)
        with pytest.raises(DataError, match="leads out"):
            load_character(data, "twin")
    (folder / "mesh/mesh.obj").unlink()
    shutil.copy(outside / "mesh/mesh.obj", folder / "mesh/mesh.obj")
    mesh = load_surface_mesh(folder / "mesh/mesh.obj")
    write_surface_mesh(folder / "mesh/mesh.obj", mesh)
    (folder / "mesh/mesh.mtl").unlink()
    (folder / "mesh/mesh.mtl").symlink_to("/etc/passwd")
    with pytest.raises(DataError):
        load_surface_mesh(folder / "mesh/mesh.obj")


def test_folders_of_characters_may_be_links_to_other_disks(data: Path, tmp_path: Path) -> None:
    shutil.move(data / "twin", tmp_path / "disk")
    (data / "twin").symlink_to(tmp_path / "disk")
    assert load_character(data, "twin").mesh_file is not None


@pytest.mark.parametrize("name", ["../data/twin", "/etc", ".", "..", "twin/../twin", "", "a\0b", "twin/"])
def test_a_character_is_a_name(name: str, data: Path, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="expected letters, digits"):
        load_character(data, name)
    for command in (["draw"], ["mesh"]):
        assert run([*command, "--data", str(data), "--character", name, "-o", str(tmp_path / "out")]) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "view", ["../../evil", "/evil", "a/b", "..", "", "x" * 300, "a\0b", "\ud800", "a\nb", "a\\b"]
)
def test_views_are_no_paths(view: str, data: Path, tmp_path: Path) -> None:
    change(
        data / "twin/transforms.json",
        lambda one: one["source_views"].update({view: one["source_views"].pop("side")}),
    )
    before = sorted(tmp_path.rglob("*"))
    assert (
        run(["draw", "--data", str(data), "--character", "twin", "-o", str(tmp_path / "out"), "--size", "32"])
        == 1
    )
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "edit",
    [
        lambda one: one["splits"].update({"../x": ["twin"]}),
        lambda one: one["splits"].update(test=["../x"]),
        lambda one: one["splits"].update(test=["a"] * 300_000),
        lambda one: one.update(splits={"a": {"deep": 1}}),
        lambda one: one.update(splits=[1] * 100_000),
    ],
)
def test_lists_of_characters_are_names(edit: Callable[[dict], object], data: Path) -> None:
    change(data / "dataset.json", edit)
    with pytest.raises(DataError) as caught:
        read_dataset(data)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("edit", "problem"),
    [
        (lambda one: one.update(frames=one["frames"] * 100_000), r"more than \d+ bytes"),
        (lambda one: one.update(frames=[{}] * 300_000), "frames: found 300000, expected at most 10000"),
        (lambda one: one["frames"][0].update(w=1e9), r"frames\[0\]\.w: found 1000000000"),
        (lambda one: one.update(w=10**9, h=10**9), r"frames\[0\]\.w: found"),
        (lambda one: one["source_views"]["front"].update(w=1e9, h=1e9), r"source_views\.front\.w: found"),
        (lambda one: one.update(source_views={str(one): {} for one in range(3000)}), "source_views: found 3000"),
        (lambda one: one.update(fl_x=10**400), r"fl_x: found"),
        (lambda one: one["frames"][0].update(transform_matrix=[[10**400] * 4] * 4), "transform_matrix: found"),
        (lambda one: one["frames"][0].update(transform_matrix=[[]]), "transform_matrix: found"),
        (lambda one: one["frames"].append(3), r"frames\[3\]: found 3"),
    ],
)  # fmt: skip
def test_sizes_of_cameras_do_not_fill_memory(
    edit: Callable[[dict], object], problem: str, data: Path
) -> None:
    change(data / "twin/transforms.json", edit)
    with pytest.raises(DataError, match=problem):
        load_character(data, "twin")


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"a":' * 100_000, '{"a": ' + "9" * 5000 + "}", "\x00", "", "[]", '"x"']
)
def test_json_that_is_none_is_one_error(text: str, tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(DataError, match=r"x\.json: "):
        read_json(tmp_path / "x.json")


READERS = {
    "x.png": (load_drawing, lambda path: read_rgba(path, (32, 32))),
    "x.json": (read_json, read_metrics),
    "x.csv": (read_curve, read_views),
    "x.safetensors": (charnerf.load, charnerf.load_baked),
    "x.ckpt": (charnerf.load,),
    "x.glb": (load_scene,),
    "x.obj": (load_scene, load_surface_mesh),
    "metrics.json": (lambda path: read_runs(path.parent),),
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("kind", ["pipe", "folder", "device", "socket"])
def test_what_is_no_file_is_refused_at_once(name: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / name
    {
        "pipe": os.mkfifo,
        "folder": Path.mkdir,
        "device": lambda one: one.symlink_to("/dev/zero"),
        "socket": lambda one: os.mknod(one, 0o140644),
    }[kind](path)
    for reader in READERS[name]:
        with pytest.raises(DataError):
            reader(path)


def test_a_file_that_becomes_a_pipe_once_it_was_looked_at_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stranger may swap the two between a look and the opening; who opens a pipe waits for its writer."""
    path, pipe = tmp_path / "x.json", tmp_path / "pipe"
    path.write_text("{}")
    os.mkfifo(pipe)
    plain = os.open

    def swapped(name: object, *more: int) -> int:
        os.replace(pipe, path)
        return plain(name, *more)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", swapped)
    with pytest.raises(DataError, match="found a pipe"):
        read_json(path)


@pytest.mark.parametrize("suffix", ["png", "jpg", "eps"])
def test_no_program_is_started_for_a_picture(suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"front.{suffix}"
    file.write_bytes(EPS)
    with pytest.raises(DataError):
        load_drawing(file)
    with pytest.raises(DataError):
        read_rgba(file, (64, 64))
    assert not {"EPS", "WMF", "PSD", "FITS", "PDF", "GRIB", "HDF5", "BUFR"} & set(FORMATS)


def test_a_picture_of_many_pixels_is_refused_undecoded(tmp_path: Path) -> None:
    (tmp_path / "x.png").write_bytes(huge_png())
    for reader in (load_drawing, lambda path: read_rgba(path, (32, 32))):
        with pytest.raises(DataError, match="60000 x 60000"):
            reader(tmp_path / "x.png")
    limit = Image.MAX_IMAGE_PIXELS
    with pytest.raises(DataError, match="expected at most 200 million"), open_picture(huge_png(), "it"):
        pass
    assert Image.MAX_IMAGE_PIXELS == limit


def textured_gltf(folder: Path, picture: bytes, *, suffix: str = "glb", gloss: bool = False) -> Path:
    """A box whose texture has other bytes."""
    mesh = trimesh.creation.box()
    small = Image.new("RGB", (4, 4))
    mesh.visual = trimesh.visual.TextureVisuals(
        uv=mesh.vertices[:, :2], material=trimesh.visual.material.PBRMaterial(baseColorTexture=small)
    )
    tree = json.loads(trimesh.exchange.gltf.export_gltf(trimesh.Scene([mesh]))["model.gltf"])
    for name, content in trimesh.exchange.gltf.export_gltf(trimesh.Scene([mesh])).items():
        (folder / name).write_bytes(content)
    tree["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(picture).decode()}]
    if gloss:
        tree["materials"] = [
            {
                "extensions": {
                    "KHR_materials_pbrSpecularGlossiness": {
                        "diffuseTexture": {"index": 0},
                        "specularGlossinessTexture": {"index": 0},
                    }
                }
            }
        ]
    (folder / "model.gltf").write_text(json.dumps(tree))
    return folder / "model.gltf"


@pytest.mark.parametrize("gloss", [False, True])
def test_pictures_in_gltf_are_bounded_as_drawings_are(gloss: bool, tmp_path: Path) -> None:
    opened = Image.open
    with pytest.raises(DataError, match=r"model\.gltf: .*60000 x 60000 pixels, expected at most 200 million"):
        load_scene(textured_gltf(tmp_path, huge_png(), gloss=gloss))
    with pytest.raises(DataError, match=r"model\.gltf: picture number 0: can not be read"):
        load_scene(textured_gltf(tmp_path, EPS, gloss=gloss))
    good = io.BytesIO()
    Image.new("RGB", (8, 8), (200, 0, 0)).save(good, "PNG")
    scene = load_scene(textured_gltf(tmp_path, good.getvalue()))
    assert next(iter(scene.geometry.values())).visual.material.baseColorTexture.size == (8, 8)
    assert Image.open is opened


@pytest.mark.parametrize("where", ["buffers", "images"])
def test_gltf_reads_its_own_folder_alone(where: str, tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    file = textured_gltf(tmp_path / "own", EPS)
    (tmp_path / "secret.bin").write_bytes(b"0" * 10_000)
    (tmp_path / "own/link.bin").symlink_to(tmp_path / "secret.bin")
    for name in ("../secret.bin", str(tmp_path / "secret.bin"), "link.bin"):
        change(file, lambda one, name=name: one[where][0].update(uri=name))
        with pytest.raises(DataError, match="leads out"):
            load_scene(file)


def test_an_obj_reads_its_own_folder_alone(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl a\nKd 1 0 0\n")
    body = "mtllib {}\nusemtl a\n" + trimesh.exchange.obj.export_obj(trimesh.creation.box())
    (tmp_path / "own/x.obj").write_text(body.format("../secret.mtl"))
    with pytest.raises(DataError, match="leads out"):
        load_scene(tmp_path / "own/x.obj")
    (tmp_path / "own/x.obj").write_text(body.format("/artist/at/home/lost.mtl"))
    with pytest.raises(DataError, match=r"lost\.mtl, which is not in its folder"):
        load_scene(tmp_path / "own/x.obj")
    (tmp_path / "own/x.mtl").write_text("newmtl a\nmap_Kd pipe.png\n")
    os.mkfifo(tmp_path / "own/pipe.png")
    (tmp_path / "own/x.obj").write_text(body.format("x.mtl"))
    with pytest.raises(DataError, match="a pipe"):
        load_scene(tmp_path / "own/x.obj")


@pytest.mark.parametrize(
    "edit",
    [
        lambda one: one["nodes"][0].update(children=[0]),
        lambda one: one.update(nodes=[{"children": [1]}, {"children": [2]}, {"children": [1]}]),
        lambda one: one.update(nodes=[{"children": [1, 1]}, {}]),
        lambda one: one.update(nodes=[{"children": [5]}]),
        lambda one: one.update(nodes=[{}] * 200_000),
        lambda one: one["accessors"][0].update(count=10**12),
        lambda one: one["accessors"][0].pop("bufferView") or one["accessors"][0].update(count=10**10),
        lambda one: one.update(nodes=3),
        lambda one: one["nodes"][0].update(name="\ud800"),
    ],
)
def test_gltf_that_never_ends_is_refused(edit: Callable[[dict], object], tmp_path: Path) -> None:
    file = textured_gltf(tmp_path, EPS)
    change(file, edit)
    with pytest.raises(DataError, match=r"model\.gltf: "):
        load_scene(file)


@pytest.mark.parametrize("size", [(16, 20_000), (20_000, 16)])
def test_a_thread_is_no_drawing(size: tuple[int, int], tmp_path: Path) -> None:
    Image.new("RGB", size).save(tmp_path / "x.png")
    with pytest.raises(DataError, match=r"x\.png: found .* expected one side at most 50 times the other"):
        load_drawing(tmp_path / "x.png")
