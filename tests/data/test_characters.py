import json
import os
import signal
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import torch
from PIL import Image

from charnerf.data.characters import (
    CharacterPictures,
    load_character,
    write_character,
)
from charnerf.data.layout import DatasetInfo, write_dataset
from charnerf.data.partial import whole_characters
from charnerf.errors import DataError
from charnerf.geometry.cameras import fibonacci_hemisphere, pixel_rays
from charnerf.geometry.framing import framing_cameras, source_cameras

SIZE = 8


def make_pictures(depth=True):
    rng = np.random.default_rng(0)
    targets = framing_cameras(fibonacci_hemisphere(4), radius=1.2, size=SIZE)
    sources = source_cameras(radius=1.2, size=SIZE)
    return CharacterPictures(
        cameras=targets,
        images=rng.integers(0, 256, (4, SIZE, SIZE, 4), dtype=np.uint8),
        source_cameras=sources,
        source_images=rng.integers(0, 256, (3, SIZE, SIZE, 4), dtype=np.uint8),
        source_names=("front", "side", "back"),
        depths=rng.integers(0, 5000, (4, SIZE, SIZE), dtype=np.uint16) if depth else None,
    )


@pytest.fixture
def character_folder(tmp_path):
    return write_character(tmp_path, "hero", make_pictures(), write_mesh=lambda file: file.write_text("x"))


def change(folder, edit):
    path = folder / "transforms.json"
    content = json.loads(path.read_text())
    edit(content)
    path.write_text(json.dumps(content))


def test_round_trip(character_folder):
    pictures = make_pictures()
    hero = load_character(character_folder.parent, "hero")
    assert torch.equal(hero.images([2, 0]), torch.from_numpy(pictures.images[[2, 0]]))
    np.testing.assert_allclose(hero.depths([3])[0], pictures.depths[3] / 1000.0, atol=1e-6)
    front = hero.sources.images[0, 0].permute(1, 2, 0)
    np.testing.assert_array_equal(np.rint(255 * front.numpy()), pictures.source_images[0])
    torch.testing.assert_close(
        hero.cameras.world_from_camera, pictures.cameras.world_from_camera.float(), rtol=0, atol=0
    )
    torch.testing.assert_close(hero.cameras.focal, pictures.cameras.focal.float(), rtol=0, atol=0)
    assert hero.source_names == ("front", "side", "back")
    assert hero.sources.cameras.shape == (1, 3)
    assert bool(hero.sources.cameras.orthographic.all()) and not bool(hero.cameras.orthographic.any())
    assert bool(hero.sources.present.all()) and not bool(hero.sources.mirrored.any())
    assert hero.mesh_file == character_folder / "mesh/mesh.obj"


def test_poses_stand_in_text_files_too(character_folder):
    poses = torch.tensor(np.stack([np.loadtxt(character_folder / f"poses/00{i}.txt") for i in range(4)]))
    torch.testing.assert_close(poses, make_pictures().cameras.world_from_camera, atol=1e-8, rtol=0)


def test_transforms_mean_what_nerfstudio_and_instant_ngp_read(character_folder):
    """Their rays: ((x - cx) / fl, -(y - cy) / fl, -1) turned by the OpenGL pose, from its last column."""
    content = json.loads((character_folder / "transforms.json").read_text())
    keys = {"w", "h", "fl_x", "fl_y", "cx", "cy", "k1", "k2", "p1", "p2", "camera_angle_x", "aabb_scale"}
    assert keys <= set(content)
    assert content["fl_x"] == pytest.approx(0.5 * content["w"] / np.tan(0.5 * content["camera_angle_x"]))
    assert np.log2(content["aabb_scale"]) % 1.0 == 0.0
    pixel = np.array([1.5, 6.5])
    for index, frame in enumerate(content["frames"]):
        pose = np.array(frame["transform_matrix"])
        local = np.array(
            [
                (pixel[0] - content["cx"]) / content["fl_x"],
                -(pixel[1] - content["cy"]) / content["fl_y"],
                -1.0,
            ]
        )
        theirs = pose[:3, :3] @ (local / np.linalg.norm(local))
        ours = pixel_rays(load_character(character_folder.parent, "hero").cameras[index], torch.tensor(pixel))
        np.testing.assert_allclose(ours.directions, theirs, atol=1e-6)
        np.testing.assert_allclose(ours.origins, pose[:3, 3], atol=1e-6)
        assert (character_folder / frame["file_path"]).is_file()
        assert (character_folder / frame["depth_file_path"]).is_file()
    side = content["source_views"]["side"]
    assert side["camera_model"] == "ORTHOGRAPHIC"
    assert side["fl_x"] == pytest.approx(SIZE / 2.4)  # pixels per metre
    np.testing.assert_allclose(np.array(side["transform_matrix"])[:3, 2], (1.0, 0.0, 0.0), atol=1e-12)


def test_a_character_without_mesh_depth_and_side_view_loads(tmp_path):
    folder = write_character(tmp_path, "hero", make_pictures(depth=False))
    change(folder, lambda content: content["source_views"].pop("side"))
    hero = load_character(tmp_path, "hero")
    assert hero.mesh_file is None and hero.depth_files == ()
    assert hero.source_names == ("front", "back")
    with pytest.raises(DataError, match="has no depth pictures"):
        hero.depths([0])
    with pytest.raises(DataError, match=r"found 2 source views \(front, back\), expected at least 3"):
        load_character(tmp_path, "hero", num_sources=3)


def test_views_come_in_order_and_blender_keys_are_read(character_folder):
    def shuffle(content):
        views = content["source_views"]
        content["source_views"] = {name: views[name] for name in ("back", "front", "side")}
        for key in ("fl_x", "fl_y", "cx", "cy"):
            content.pop(key)
        for frame in content["frames"]:
            frame["file_path"] = frame["file_path"].removesuffix(".png")

    before = load_character(character_folder.parent, "hero")
    change(character_folder, shuffle)
    after = load_character(character_folder.parent, "hero")
    assert after.source_names == before.source_names
    assert torch.equal(after.sources.images, before.sources.images)
    torch.testing.assert_close(after.cameras.focal, before.cameras.focal)
    torch.testing.assert_close(after.cameras.principal_point, before.cameras.principal_point)


def _set(*keys):
    *path, last, value = keys

    def edit(content):
        for key in path:
            content = content[key]
        content[last] = value

    return edit


@pytest.mark.parametrize(
    "edit, message",
    [
        (_set("frames", []), "frames: found .*expected a list of at least one"),
        (_set("frames", 1, "transform_matrix", [[1, 0], [0, 1]]), r"frames\[1\]\.transform_matrix.*\(2, 2\)"),
        (_set("frames", 1, "transform_matrix", "no"), r"frames\[1\]\.transform_matrix: found 'no'"),
        (
            _set("frames", 2, "transform_matrix", 0, 0, float("nan")),
            r"frames\[2\]\.transform_matrix: holds NaN",
        ),
        (_set("frames", 2, "transform_matrix", 0, 0, 9.0), r"frames\[2\].*is no rotation"),
        (_set("frames", 2, "transform_matrix", 3, 0, 9.0), r"frames\[2\].*expected 0 0 0 1"),
        (
            _set("frames", 0, "file_path", "images/9.png"),
            r"images/9\.png: no such file, named by .*frames\[0\]",
        ),
        (_set("frames", 0, "file_path", 5), r"frames\[0\]\.file_path: found 5"),
        (_set("fl_x", float("nan")), r"frames\[0\]\.fl_x: found nan, expected a finite number"),
        (_set("fl_x", -1.0), "expected positive pixels"),
        (_set("w", 0), r"frames\[0\]\.w: found 0"),
        (_set("k1", 0.1), "lens distortion.*undistort"),
        (_set("frames", 0, "camera_model", "FISHEYE"), "camera_model: found 'FISHEYE'"),
        (_set("source_views", {}), "has no source_views"),
        (_set("source_views", "front", "cx", "mid"), r"source_views\.front\.cx: found 'mid'"),
        (
            _set("source_views", "back", "w", 9),
            r"source_views\.back: found w, h = \(9, 8\), the first has \(8, 8\)",
        ),
    ],
)
def test_wrong_transforms_are_named(character_folder, edit, message):
    change(character_folder, edit)
    with pytest.raises(DataError, match=message) as caught:
        load_character(character_folder.parent, "hero")
    assert str(character_folder) in str(caught.value)


def test_wrong_pictures_are_named(character_folder):
    hero = load_character(character_folder.parent, "hero")
    Image.new("RGBA", (4, 6)).save(character_folder / "images/000.png")
    (character_folder / "images/001.png").write_bytes(b"not a picture")
    whole = (character_folder / "images/002.png").read_bytes()
    (character_folder / "images/002.png").write_bytes(whole[: len(whole) // 2])
    Image.new("L", (SIZE, SIZE)).save(character_folder / "depth/000.png")
    with pytest.raises(DataError, match=r"000\.png: found 4 x 6 pixels, expected 8 x 8"):
        hero.images([0])
    with pytest.raises(DataError, match=r"001\.png: can not be read as a picture"):
        hero.images([1])
    with pytest.raises(DataError, match=r"002\.png: can not be read as a picture"):
        hero.images([2])
    with pytest.raises(DataError, match=r"depth/000\.png: found mode L, expected 16-bit"):
        hero.depths([0])
    (character_folder / "sources/side.png").unlink()
    with pytest.raises(DataError, match=r"side\.png: no such file, named by .*source_views\.side"):
        load_character(character_folder.parent, "hero")


def test_a_missing_character_is_named_with_those_there_are_the_likest_first(tmp_path):
    splits = {"train": tuple(f"a{number}" for number in range(20)), "test": ("robot",)}
    write_dataset(DatasetInfo(root=tmp_path, splits=splits, made_by={}))
    with pytest.raises(
        DataError,
        match=r"found no character 'robto', expected one of the data set's: robot, a0, .* and 9 more",
    ):
        load_character(tmp_path, "robto")
    with pytest.raises(DataError, match="no such folder, expected the character 'robot'; capture it"):
        load_character(tmp_path, "robot")


def test_a_name_that_is_there_is_refused(character_folder):
    with pytest.raises(DataError, match="hero: is there already"):
        write_character(character_folder.parent, "hero", make_pictures())


def test_a_failing_writer_leaves_nothing(tmp_path):
    def fail(file):
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_character(tmp_path, "hero", make_pictures(), write_mesh=fail)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="kills a process")
def test_a_killed_writer_leaves_no_character(tmp_path):
    """The remains are hidden, and the next capture removes them."""
    code = """
        import os, signal, sys
        sys.path.insert(0, sys.argv[2])
        from test_characters import make_pictures
        from charnerf.data.characters import write_character
        die = lambda file: os.kill(os.getpid(), signal.SIGKILL)
        write_character(sys.argv[1], "hero", make_pictures(), write_mesh=die)
    """
    here = os.path.dirname(__file__)
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code), str(tmp_path), here], check=False)
    assert done.returncode == -signal.SIGKILL
    left = [path.name for path in tmp_path.iterdir()]
    assert len(left) == 1 and left[0].startswith(".partial-")
    with whole_characters(tmp_path):
        assert list(tmp_path.iterdir()) == []
