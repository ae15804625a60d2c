import numpy as np
import pytest
import trimesh
from PIL import Image

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset, capture_scene_to
from charnerf.capture.renderers import built_in
from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.errors import ConfigError, DataError
from charnerf.surfaces.mesh_files import load_surface_mesh
from support.gltf_files import Figure, png

TINY = CaptureOptions(views=2, size=16)


def write_box(file, extents=(1.0, 4.0, 1.0)):
    trimesh.creation.box(extents).export(file)
    return file


def test_good_meshes_are_kept_beside_bad_ones(tmp_path):
    """In two processes; folders expand, names are file stems, the bad file is told, the split is sorted."""
    (tmp_path / "in").mkdir()
    write_box(tmp_path / "in/b.obj")
    write_box(tmp_path / "in/a.glb")
    (tmp_path / "in/notes.txt").write_text("")
    (tmp_path / "bad.stl").write_bytes(b"no mesh")
    root = tmp_path / "set"
    report = capture_dataset(
        [tmp_path / "bad.stl", tmp_path / "in"], root, "train", options=TINY, processes=2
    )
    assert set(report.captured) == {"a", "b"}
    assert len(report.failed) == 1 and str(tmp_path / "bad.stl") in report.failed[0]
    info = read_dataset(root)
    assert names_of(info, "train") == ("a", "b")
    assert info.made_by["views"] == 2
    assert sorted(path.name for path in root.iterdir()) == ["a", "b", "dataset.json"]
    hero = load_character(root, "a")
    assert hero.images([0, 1]).shape == (2, 16, 16, 4)
    corners = load_surface_mesh(hero.mesh_file).triangles.reshape(-1, 3)
    np.testing.assert_allclose(corners.max(axis=0), (0.25, 0.25, 2.0), atol=1e-5)


def test_one_mesh_that_fails_in_any_way_stops_no_other(tmp_path, monkeypatch):
    """A picture that ends half-way, and one too large for the machine."""
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8)
    Figure(png(Image.fromarray(noise))[:6000]).write(tmp_path / "a_half.glb")
    Figure().write(tmp_path / "b_good.glb")
    Figure().write(tmp_path / "c_huge.glb")
    read = built_in.load_scene

    def read_or_fail(file, *axes):
        if file.stem == "c_huge":
            raise MemoryError("80 GiB")
        return read(file, *axes)

    monkeypatch.setattr(built_in, "load_scene", read_or_fail)
    report = capture_dataset([tmp_path], tmp_path / "set", "train", options=TINY, processes=1)
    assert report.captured == ("b_good",)
    half, huge = report.failed
    assert half.startswith(str(tmp_path / "a_half.glb")) and "picture of material 'skin'" in half
    assert huge.startswith(str(tmp_path / "c_huge.glb")) and "80 GiB" in huge


def test_a_data_set_grows_and_refuses_names_it_has(tmp_path):
    root = tmp_path / "set"
    capture_dataset([write_box(tmp_path / "a.obj")], root, "train", options=TINY, processes=1)
    capture_dataset([write_box(tmp_path / "b.obj")], root, "test", options=TINY, processes=1)
    assert read_dataset(root).splits == {"train": ("a",), "test": ("b",)}
    before = (root / "a/transforms.json").stat().st_mtime_ns
    with pytest.raises(DataError, match=r"already holds a \(split train\)"):
        capture_dataset([tmp_path / "a.obj"], root, "test", options=TINY, processes=1)
    assert (root / "a/transforms.json").stat().st_mtime_ns == before


def test_a_wrong_call_writes_nothing(tmp_path):
    root = tmp_path / "set"
    box = write_box(tmp_path / "a.obj")
    with pytest.raises(DataError, match=r"gone\.obj: no such file or folder"):
        capture_dataset([tmp_path / "gone.obj"], root, "train", options=TINY)
    with pytest.raises(DataError, match="found no mesh in this folder"):
        (tmp_path / "empty").mkdir()
        capture_dataset([tmp_path / "empty"], root, "train", options=TINY)
    with pytest.raises(DataError, match="found none"):
        capture_dataset([], root, "train", options=TINY)
    with pytest.raises(ConfigError, match="up = 'x'"):
        capture_dataset([box], root, "train", options=TINY, up="x")
    with pytest.raises(DataError, match="split 'a/b'"):
        capture_dataset([box], root, "a/b", options=TINY)
    assert not root.exists()


def test_a_scene_is_written_with_all_files(tmp_path):
    scene = trimesh.Scene(trimesh.creation.box((0.5, 0.5, 2.0)).apply_translation((0, 0, 1)))
    folder = capture_scene_to(tmp_path, "box", scene, CaptureOptions(views=2, size=16, depth=True))
    found = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    assert found == [
        "depth/000.png",
        "depth/001.png",
        "images/000.png",
        "images/001.png",
        "mesh/mesh.mtl",
        "mesh/mesh.obj",
        "poses/000.txt",
        "poses/001.txt",
        "sources/back.png",
        "sources/front.png",
        "sources/side.png",
        "transforms.json",
    ]
    assert not (tmp_path / "dataset.json").exists()
    depth = load_character(tmp_path, "box").depths([0])
    assert 1.5 < float(depth.max()) < 6.0
