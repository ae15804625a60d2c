"""Every format, written in its own conventions: one and the same figure comes out, standing as ours stand."""

import gzip
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from charnerf.cli import check, run
from charnerf.data import json_values
from charnerf.data.characters import Character, load_character
from charnerf.data.layout import read_dataset
from charnerf.errors import ConfigError, DataError
from charnerf.foreign import kept
from charnerf.foreign.data import ForeignData
from charnerf.foreign.kept import kept_copy, recognised
from charnerf.foreign.reading import Reading
from charnerf.interruption import Stopped
from charnerf.types import Cameras
from support import foreign_sets as sets
from support.processes import ended_process

TURNED = 25.0  # degrees about z, beside 0.3 of the size and a shift
WRITERS = {
    "nerf_blender": sets.write_nerf_blender,
    "nerfstudio": sets.write_nerfstudio,
    "srn": sets.write_srn,
    "nmr": sets.write_nmr,
    "co3d": lambda folder, cameras, images: sets.write_co3d(folder / "co3d", cameras, images),
}


@pytest.fixture(scope="module")
def shown() -> tuple[Cameras, list[np.ndarray]]:
    """Cameras of a world of ours and what they see."""
    cameras = sets.around()
    return cameras, sets.pictures(cameras)


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory, shown: tuple) -> Callable[[str], Path]:
    """A folder of a format, of a smaller world that is turned and shifted; read only."""
    root = tmp_path_factory.mktemp("foreign")
    moved = sets.elsewhere(shown[0], sets.turn_about_z(TURNED))

    def folder(kind: str) -> Path:
        if not (root / kind).exists():
            WRITERS[kind](root / kind, moved, shown[1])
        return root / kind

    return folder


def read(folder: Path, cache: Path, **said: object) -> Character:
    home = kept_copy(folder, Reading(**{"size": sets.SIZE, **said}), cache=cache, processes=1)
    return load_character(home, next(iter(read_dataset(home).splits.values()))[0])


@pytest.mark.parametrize("kind", WRITERS)
def test_one_figure_comes_out_of_every_format(
    kind: str, foreign: Callable, shown: tuple, tmp_path: Path
) -> None:
    """Feet on the floor, 2 m, front camera at azimuth 0; to the precision of silhouettes of 32 pixels, whole ones in SRN."""
    front, side, back = (7, 6, 5) if kind == "co3d" else (0, 1, 2)  # whose frames are numbered backwards
    hero = read(foreign(kind), tmp_path, front=front, side=side, back=back)
    assert hero.source_names == ("front", "side", "back")
    seen = torch.cat((hero.sources.cameras.world_from_camera[0], hero.cameras.world_from_camera))
    true = shown[0].world_from_camera.float()
    for pose in seen:
        nearest = true[(true[:, :3, 3] - pose[:3, 3]).norm(dim=-1).argmin()]
        torch.testing.assert_close(pose[:3, :3], nearest[:3, :3], atol=1e-4, rtol=0)
        torch.testing.assert_close(pose[:3, 3], nearest[:3, 3], atol=0.13 if kind == "srn" else 0.08, rtol=0)
    alpha = hero.sources.images[0, 0, 3]
    true_alpha = torch.from_numpy(shown[1][0][..., 3]) / 255.0
    assert float((alpha - true_alpha).abs().mean()) < 0.02
    torch.testing.assert_close(
        hero.cameras.focal, shown[0].focal[: len(hero.cameras.focal)].float(), atol=1e-3, rtol=0
    )


def test_views_are_found_by_azimuth_and_frames_may_be_kept(
    foreign: Callable, shown: tuple, tmp_path: Path
) -> None:
    world = tmp_path / "plain"
    sets.write_nerfstudio(world, *shown)
    hero = read(world, tmp_path, keep_frame=True)
    torch.testing.assert_close(
        hero.sources.cameras.world_from_camera[0], shown[0].world_from_camera[:3].float()
    )
    turned = read(
        foreign("nerfstudio"), tmp_path
    )  # its own -Y is the front: nearest is the camera of azimuth 320
    assert float(turned.sources.cameras.world_from_camera[0, 0, 0, 2]) == pytest.approx(
        np.sin(np.deg2rad(320.0 + TURNED)), abs=0.01
    )


def test_a_picture_is_bent_straight(shown: tuple, tmp_path: Path) -> None:
    """A picture through Brown's lens and its coefficients gives back the pinhole's picture."""
    lens = {"k1": -1.2, "k2": 0.5, "p1": 0.05, "p2": -0.05}
    cameras, images = sets.around(64), sets.pictures(sets.around(64))
    folder = tmp_path / "bent"
    sets.write_nerfstudio(folder, cameras, images, **lens)
    for index, image in enumerate(images):
        bent = sets.through_lens(image, float(cameras.focal[0, 0]), **lens)
        Image.fromarray(bent[..., :3]).save(folder / f"images/frame_{index:05d}.png")
        Image.fromarray(bent[..., 3]).save(folder / f"masks/frame_{index:05d}.png")
    straight = (
        read(folder, tmp_path, front=0, side=1, back=2, size=64, keep_frame=True)
        .sources.images[0, 0, 3]
        .numpy()
    )
    bent_alpha = sets.through_lens(images[0], float(cameras.focal[0, 0]), **lens)[..., 3] / 255.0
    true, off = (
        images[0][..., 3] > 127,
        [int(((one > 0.5) != (images[0][..., 3] > 127)).sum()) for one in (straight, bent_alpha)],
    )
    assert off[0] < 0.01 * true.sum() < 0.1 * true.sum() < off[1]


def test_each_frame_may_have_its_own_camera_and_size(shown: tuple, tmp_path: Path) -> None:
    """Intrinsics of frames go before those of the file; pictures that are no squares stand in the middle of one."""
    folder = tmp_path / "mixed"
    sets.write_nerfstudio(folder, *shown)
    content = json.loads((folder / "transforms.json").read_text())
    frame, focal = content["frames"][4], content["fl_x"]
    wide = np.concatenate((shown[1][4], shown[1][4][:, :16] * 0), axis=1)  # 48 x 32: background to the right
    for place, channels in (("images", wide[..., :3]), ("masks", wide[..., 3])):
        Image.fromarray(channels).save(folder / place / "frame_00004.png")
    frame.update(w=48, h=32, fl_x=focal, fl_y=focal, cx=16.0, cy=16.0)
    (folder / "transforms.json").write_text(json.dumps(content))
    hero = read(folder, tmp_path, front=0, side=1, back=2, keep_frame=True, size=48)
    torch.testing.assert_close(hero.cameras.focal[1], torch.tensor([focal, focal]))
    torch.testing.assert_close(hero.cameras.principal_point[1], torch.tensor([16.0, 24.0]))
    torch.testing.assert_close(hero.cameras.focal[0], torch.tensor([1.5 * focal, 1.5 * focal]))
    assert (hero.images([1])[0, :8, :, 3] == 0).all() and (hero.images([1])[0, 40:, :, 3] == 0).all()


def test_sets_of_characters_and_their_splits(foreign: Callable, tmp_path: Path) -> None:
    root = tmp_path / "many"
    for split, name in (("train", "ann"), ("train", "bob"), ("test", "käthe 3")):
        shutil.copytree(foreign("nerfstudio"), root / split / name)
    _, found = recognised(root)
    assert [(one.split, one.name) for one in found] == [
        ("train", "ann"),
        ("train", "bob"),
        ("test", "k_the_3"),
    ]
    shutil.copytree(foreign("srn"), tmp_path / "srn_cars/cars_train/a1")
    shutil.copytree(foreign("srn"), tmp_path / "srn_cars/cars_test/b2")
    assert [(one.split, one.name) for one in recognised(tmp_path / "srn_cars")[1]] == [
        ("test", "b2"),
        ("train", "a1"),
    ]
    shutil.copytree(foreign("nmr"), tmp_path / "shapes/0277/x1")
    (tmp_path / "shapes/0277/softras_val.lst").write_text("x1\nmissing\n")
    assert [(one.split, one.name) for one in recognised(tmp_path / "shapes")[1]] == [("val", "0277-x1")]


def test_what_is_kept_is_read_again_only_where_a_file_changed(foreign: Callable, tmp_path: Path) -> None:
    folder = tmp_path / "own"
    shutil.copytree(foreign("srn"), folder)
    hero = read(folder, tmp_path, front=0)
    (hero.folder / "seen").touch()
    assert (read(folder, tmp_path, front=0).folder / "seen").exists()
    os.utime(folder / "rgb/000003.png", ns=(1, 1))
    assert not (read(folder, tmp_path, front=0).folder / "seen").exists()
    assert not list(folder.glob(".*")) and sorted(one.name for one in folder.iterdir()) == [
        "intrinsics.txt",
        "pose",
        "rgb",
    ]


def test_what_a_killed_process_left_goes_when_the_reading_is_stopped(
    foreign: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def stopped(work: partial, *_: object) -> Iterator[None]:
        (work.keywords["home"] / f".partial-{ended_process()}-hero/images").mkdir(parents=True)
        raise Stopped(15)
        yield

    monkeypatch.setattr(kept, "in_processes", stopped)
    with pytest.raises(Stopped):
        read(foreign("srn"), tmp_path, front=0)
    assert [path.name for path in tmp_path.glob("*/*")] == [".read.lock"]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"camera_model": "OPENCV_FISHEYE"}, r"frames\[0\]\.camera_model: found 'OPENCV_FISHEYE'.*undistort"),
        ({"is_fisheye": True}, "found is_fisheye"),
        ({"k4": 0.1}, r"lens distortion \{'k4': 0.1\}, expected k1, k2, k3, p1, p2 alone"),
        ({"k1": -9.0}, "folds the picture"),
        ({"fl_x": float("nan")}, "fl_x: found nan"),
        ({"w": 31}, "found 32 x 32 pixels, expected 31 x 32"),
        ({"frames": []}, "frames: found"),
        ({"frames": [{"file_path": "../x.png", "transform_matrix": np.eye(4).tolist()}] * 4}, "leads out"),
    ],
)  # fmt: skip
def test_what_is_not_understood_is_refused_by_name(
    keys: dict, message: str, shown: tuple, tmp_path: Path
) -> None:
    sets.write_nerfstudio(tmp_path / "odd", *shown)
    file = tmp_path / "odd/transforms.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **keys}))
    with pytest.raises(DataError, match=message) as caught:
        read(tmp_path / "odd", tmp_path)
    assert str(tmp_path / "odd") in str(caught.value)


def test_unknown_keys_are_named(shown: tuple, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    sets.write_nerfstudio(tmp_path / "odd", *shown, rolling_shutter=[0, 0, 1, 0])
    read(tmp_path / "odd", tmp_path)
    assert "keys rolling_shutter are not understood" in caplog.text


def test_pictures_that_do_not_tell_the_figure_and_cameras_that_look_away(
    shown: tuple, tmp_path: Path
) -> None:
    cameras, images = shown
    sets.write_srn(tmp_path / "photo", cameras, [np.full_like(image, 90) for image in images])
    for index in range(8):
        Image.new("RGB", (32, 32), (90, 90, 90)).save(tmp_path / f"photo/rgb/{index:06d}.png")
    with pytest.raises(DataError, match="is opaque everywhere and not on white"):
        read(tmp_path / "photo", tmp_path)
    sets.write_nerfstudio(tmp_path / "opencv", sets.looking_along_z(cameras), images)
    with pytest.raises(DataError, match="8 of 8 cameras that look away"):
        read(tmp_path / "opencv", tmp_path)
    with pytest.raises(DataError, match=r"--front: found 12, but it has 8 views"):
        sets.write_nerfstudio(tmp_path / "few", cameras, images)
        read(tmp_path / "few", tmp_path, front=12)


def test_archives_of_strangers_run_nothing(shown: tuple, tmp_path: Path) -> None:
    sets.write_nmr(tmp_path / "nmr", *shown)
    np.savez(tmp_path / "nmr/cameras.npz", world_mat_0=np.array([{}], dtype=object))
    with pytest.raises(DataError, match=r"cameras\.npz: can not be read"):
        read(tmp_path / "nmr", tmp_path)


def test_archives_and_lists_of_strangers_fill_no_memory(
    shown: tuple, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sets.write_nmr(tmp_path / "nmr", *shown)
    np.savez_compressed(tmp_path / "nmr/cameras.npz", world_mat_0=np.zeros(10_000_000))
    assert (tmp_path / "nmr/cameras.npz").stat().st_size < 100_000
    with pytest.raises(DataError, match=r"cameras\.npz: found 80000\d* bytes once unpacked"):
        read(tmp_path / "nmr", tmp_path)
    sets.write_co3d(tmp_path / "co3d", *shown)
    with gzip.open(tmp_path / "co3d/frame_annotations.jgz", "wb") as file:
        file.write(b"[" + b"[]," * 1001 + b"[]]")
    sets.write_nerfstudio(tmp_path / "many", *shown, crop=[[]] * 1001)
    monkeypatch.setattr(json_values, "MOST_VALUES", 1000)
    for name in ("co3d/frame_annotations.jgz", "many/transforms.json"):
        with pytest.raises(DataError, match=rf"{name}: found 1\d\d\d values, expected at most 1000"):
            read((tmp_path / name).parent, tmp_path)


def test_a_folder_of_nothing_names_what_would_do(tmp_path: Path) -> None:
    with pytest.raises(
        DataError,
        match=r"found no data set, expected dataset\.json or one of: transforms\.json .*SRN.*NMR.*CO3D",
    ):
        recognised(tmp_path)


def test_training_and_commands_take_them(
    foreign: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    data = ForeignData(root=str(foreign("nerfstudio")), size=32, front=0, side=1, back=2, keep_frame=False)
    data.check_image_size(32)
    data.check_splits(train=["test"], val="test", test="test")
    assert len(load_character(data.prepare(), "nerfstudio").image_files) == 5
    with pytest.raises(ConfigError, match=r"data\.size: found 32"):
        data.check_image_size(64)
    out = tmp_path / "drawn"
    command = [
        "draw",
        "--data",
        str(foreign("nerfstudio")),
        "--character",
        "nerfstudio",
        "-o",
        str(out),
        "--size",
        "32",
    ]
    assert run([*command, "--front", "0", "--pixels", "32"]) == 0
    assert (out / "front.png").is_file()
    assert (
        run(
            [
                "draw",
                "--data",
                str(data.prepare()),
                "--character",
                "nerfstudio",
                "-o",
                str(out),
                "--front",
                "0",
            ]
        )
        == 2
    )
    views, camera = check._character(None, foreign("nerfstudio"), None)
    assert views.images.shape[:2] == (1, 3) and camera.width == check.CHECKED_SIZE
