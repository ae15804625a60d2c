"""Each fault, planted into a clean data set, is found and named; nothing is found where nothing was planted."""

import json
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms, ImageOps
from PIL.PngImagePlugin import PngInfo

from charnerf.cli import run
from charnerf.doctor.characters import dataset_findings
from charnerf.doctor.finding import Finding

NAME = "lefty"  # of the fixture `clean`
OPENGL_OF_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])


def found(root: Path) -> list[Finding]:
    return list(dataset_findings(root, processes=1, counter=lambda total: lambda: None))


def edited(folder: Path, change: Callable[[dict], object]) -> None:
    file = folder / "transforms.json"
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


def each_pose(folder: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    def every(content: dict) -> None:
        for one in (*content["frames"], *content["source_views"].values()):
            one["transform_matrix"] = change(np.array(one["transform_matrix"])).tolist()

    edited(folder, every)


def one_pose(folder: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    def only(content: dict) -> None:
        frame = content["frames"][4]
        frame["transform_matrix"] = change(np.array(frame["transform_matrix"])).tolist()

    edited(folder, only)


def repainted(file: Path, change: Callable[[Image.Image], Image.Image]) -> None:
    with Image.open(file) as picture:
        changed = change(picture.copy())
    changed.save(file)


def swapped(first: Path, second: Path) -> None:
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)


def turned_about_z(degrees: float) -> np.ndarray:
    angle = np.deg2rad(degrees)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return turn


def shrunk(picture: Image.Image) -> Image.Image:
    side = picture.width
    smaller = picture.resize((round(0.8 * side),) * 2, Image.Resampling.BILINEAR)
    canvas = Image.new("RGBA", (side, side))
    canvas.paste(smaller, ((side - smaller.width) // 2,) * 2)
    return canvas


def on_grey(picture: Image.Image) -> Image.Image:
    grey = Image.new("RGBA", picture.size, (90, 100, 110, 255))
    return Image.alpha_composite(grey, picture).convert("RGB")


def with_noise(picture: Image.Image) -> Image.Image:
    pixels = np.array(picture)
    pixels[..., 3] = np.maximum(pixels[..., 3], 6)
    return Image.fromarray(pixels)


def with_specks(picture: Image.Image) -> Image.Image:
    pixels = np.array(picture)
    pixels[1, 1] = pixels[30, 2] = 255
    return Image.fromarray(pixels)


def with_profile(file: Path) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    with Image.open(file) as picture:
        picture.copy().save(file, icc_profile=profile)


def with_gamma(file: Path) -> None:
    chunk = PngInfo()
    chunk.add(b"gAMA", (100_000).to_bytes(4, "big"))
    with Image.open(file) as picture:
        picture.copy().save(file, pnginfo=chunk)


def mesh_moved(folder: Path) -> None:
    lines = (folder / "mesh/mesh.obj").read_text().splitlines()
    moved = []
    for line in lines:
        x, y, z = map(float, line.split()[1:4]) if line.startswith("v ") else (0.0, 0.0, 0.0)
        moved.append(f"v {x} {z} {-y}" if line.startswith("v ") else line)  # +Y up
    (folder / "mesh/mesh.obj").write_text("\n".join(moved) + "\n")


def everything_moved(folder: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    each_pose(folder, change)
    shutil.rmtree(folder / "mesh")


def three_times(pose: np.ndarray) -> np.ndarray:
    return np.block([[pose[:3, :3], 3.0 * pose[:3, 3:]], [pose[3:]]])


def larger_drawings(content: dict) -> None:
    """Orthographic views of three times as many metres."""
    for one in content["source_views"].values():
        one.update(fl_x=one["fl_x"] / 3.0, fl_y=one["fl_y"] / 3.0)


def by_degrees(content: dict) -> None:
    content.update(camera_angle_x=float(np.rad2deg(content["camera_angle_x"])))
    for key in ("fl_x", "fl_y", "camera_angle_y"):
        content.pop(key)


def halved(content: dict) -> None:
    angle = 2.0 * np.arctan(2.0 * np.tan(0.5 * content["camera_angle_x"]))
    content.update(fl_x=0.5 * content["fl_x"], fl_y=0.5 * content["fl_y"], camera_angle_x=angle)


def listed_twice(folder: Path) -> None:
    file = folder.parent / "dataset.json"
    content = json.loads(file.read_text())
    content["splits"]["train"] = [NAME]
    file.write_text(json.dumps(content))


def depths_in_metres(folder: Path) -> None:
    for file in (folder / "depth").glob("*.png"):
        with Image.open(file) as picture:
            millimetres = np.array(picture)
        Image.fromarray((millimetres // 1000).astype(np.uint16)).save(file)


Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
PLANTED: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a camera turned in its place": ("misaligned camera", lambda one: one_pose(one, lambda pose: pose @ turned_about_z(25))),
    "a camera carried round": ("misaligned camera", lambda one: one_pose(one, lambda pose: turned_about_z(40) @ pose)),
    "a side flipped": ("mirrored picture", lambda one: repainted(one / "sources/front.png", ImageOps.mirror)),
    "a drawing shrunk": ("different scale", lambda one: repainted(one / "sources/side.png", shrunk)),
    "OpenCV's cameras": ("OpenCV for OpenGL cameras", lambda one: each_pose(one, lambda pose: pose @ OPENGL_OF_OPENCV)),
    "matrices transposed": ("row for column", lambda one: each_pose(one, np.transpose)),
    "rotations transposed": (
        "row for column",
        lambda one: each_pose(one, lambda pose: np.block([[pose[:3, :3].T, pose[:3, 3:]], [pose[3:]]])),
    ),
    "an angle in degrees": ("degrees for radians", lambda one: edited(one, by_degrees)),
    "camera_from_world": ("inverse poses", lambda one: each_pose(one, np.linalg.inv)),
    "COLMAP's poses": (
        "inverse poses",
        lambda one: each_pose(one, lambda pose: np.linalg.inv(pose @ OPENGL_OF_OPENCV)),
    ),
    "a mirrored axis": ("mirrored axes", lambda one: each_pose(one, lambda pose: pose @ np.diag([-1.0, 1, 1, 1]))),
    "scaled cameras": ("scaled axes", lambda one: each_pose(one, lambda pose: pose @ np.diag([0.1, 0.1, 0.1, 1]))),
    "a figure cut off": (
        "cropped figure",
        lambda one: repainted(one / "images/002.png", lambda picture: picture.crop((0, 8, 32, 24)).resize((32, 32))),
    ),
    "a faint background": ("dirty background", lambda one: repainted(one / "images/001.png", with_noise)),
    "specks": ("dirty background", lambda one: repainted(one / "images/001.png", with_specks)),
    "a grey background": ("background that is not white", lambda one: repainted(one / "images/003.png", on_grey)),
    "a giant": ("near and far cut", lambda one: (everything_moved(one, three_times), edited(one, larger_drawings))),
    "a world with y up": ("wrong frame", lambda one: everything_moved(one, lambda pose: Y_UP @ pose)),
    "one picture twice": ("duplicated view", lambda one: shutil.copy(one / "images/000.png", one / "images/005.png")),
    "two pictures exchanged": (
        "pictures in another order",
        lambda one: swapped(one / "sources/side.png", one / "sources/front.png"),
    ),
    "a file removed": ("missing file", lambda one: (one / "images/007.png").unlink()),
    "a file cut off": (
        "truncated file",
        lambda one: (one / "images/006.png").write_bytes((one / "images/006.png").read_bytes()[:200]),
    ),
    "16 bits": ("wrong bit depth", lambda one: Image.new("I;16", (32, 32)).save(one / "images/006.png")),
    "depth of 8 bits": ("wrong bit depth", lambda one: Image.new("L", (32, 32)).save(one / "depth/003.png")),
    "another colour space": ("colour profile", lambda one: with_profile(one / "images/004.png")),
    "linear colours": ("colour profile", lambda one: with_gamma(one / "images/004.png")),
    "NaN": ("numbers that are not finite", lambda one: one_pose(one, lambda pose: pose * np.nan)),
    "another size": ("unequal sizes", lambda one: repainted(one / "images/004.png", lambda picture: picture.resize((40, 32)))),
    "a mesh with y up": ("misaligned mesh", mesh_moved),
    "halved focal lengths": ("misaligned cameras", lambda one: edited(one, halved)),
    "an angle beside another focal length": (
        "contradicting focal lengths", lambda one: edited(one, lambda content: content.update(camera_angle_x=0.3)),
    ),
    "a picture upside down": ("misaligned camera", lambda one: repainted(one / "images/003.png", ImageOps.flip)),
    "a page in place of a picture": (
        "truncated file", lambda one: (one / "images/003.png").write_text("<html>404 Not Found</html>"),
    ),
    "depth of another size": (
        "unequal sizes", lambda one: Image.new("I;16", (16, 16), 2000).save(one / "depth/003.png"),
    ),
    "depth cut off": (
        "truncated file",
        lambda one: (one / "depth/003.png").write_bytes((one / "depth/003.png").read_bytes()[:60]),
    ),
    "depth removed": ("missing file", lambda one: (one / "depth/003.png").unlink()),
    "depth of another view": (
        "misaligned depth", lambda one: shutil.copy(one / "depth/000.png", one / "depth/006.png"),
    ),
    "depth in metres": ("wrong units of depth", depths_in_metres),
    "trained on and measured on": ("character in two splits", listed_twice),
    "an empty picture": ("empty picture", lambda one: Image.new("RGBA", (32, 32)).save(one / "images/000.png")),
}  # fmt: skip
OF_ALL = ("depth in metres",)  # pictures, of which the first few are told
MENDED = (
    "OpenCV's cameras",
    "matrices transposed",
    "an angle in degrees",
    "COLMAP's poses",
    "a side flipped",
    "scaled cameras",
)


def planted(fault: str, clean: Path, tmp_path: Path) -> Path:
    root = Path(shutil.copytree(clean, tmp_path / "data"))
    PLANTED[fault][1](root / NAME)
    return root


QUICK = ("OpenCV's cameras",)  # by default; all by -m slow
ALL = [one if one in QUICK else pytest.param(one, marks=pytest.mark.slow) for one in PLANTED]
AT_ONCE = ("a file removed", "16 bits", "NaN", "a grey background", "depth of 8 bits", "one picture twice")


def test_nothing_is_found_in_a_clean_set(clean: Path, tmp_path: Path) -> None:
    assert run(["doctor", str(clean), "-o", str(tmp_path / "out"), "--jobs", "1"]) == 0
    assert json.loads((tmp_path / "out/doctor.json").read_text())["findings"] == []


@pytest.mark.parametrize("fault", ALL)
def test_a_planted_fault_is_found(fault: str, clean: Path, tmp_path: Path) -> None:
    """By its name, once, with nothing else that is broken."""
    findings = found(planted(fault, clean, tmp_path))
    assert {one.fault for one in findings} == {PLANTED[fault][0]}, [one.line() for one in findings]
    assert len(findings) == 1 or fault in OF_ALL, [one.line() for one in findings]
    assert all(one.found and one.expected and one.fix for one in findings)


def test_faults_hide_no_others(clean: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Several of one character are all told, on a page, in JSON and by the exit status."""
    root = planted(AT_ONCE[0], clean, tmp_path)
    for fault in AT_ONCE[1:]:
        PLANTED[fault][1](root / NAME)
    assert run(["doctor", str(root), "-o", str(tmp_path / "out"), "--jobs", "1"]) == 1
    told = json.loads((tmp_path / "out/doctor.json").read_text())
    assert {PLANTED[one][0] for one in AT_ONCE} == {one["fault"] for one in told["findings"]}
    assert told["broken"] == len(told["findings"])
    page = (tmp_path / "out/doctor.html").read_text()
    assert all(one["fault"] in page for one in told["findings"])
    assert "numbers that are not finite" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("fault", MENDED)
def test_the_printed_command_mends(fault: str, clean: Path, tmp_path: Path) -> None:
    root = planted(fault, clean, tmp_path)
    command = shlex.split(found(root)[0].command)
    subprocess.run([sys.executable, *command[1:]], check=True)
    assert found(root) == []
