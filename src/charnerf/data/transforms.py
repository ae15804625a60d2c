"""transforms.json: cameras of one character as nerfstudio and instant-ngp read them, and its source views.

Poses are `world_from_camera`, OpenGL/Blender cameras, metres, as everywhere in charnerf: nothing is
converted.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from charnerf.data.json_values import count, number, section, shown
from charnerf.data.layout import TRANSFORMS_FILE, check_view_name, read_json
from charnerf.errors import DataError
from charnerf.files import inside
from charnerf.types import Cameras

MOST_SOURCES = 64  # views of a character that a model reads
MOST_FRAMES = 10_000  # of a character
AABB_SCALE = 4  # instant-ngp's box of 4 units holds cameras and character under its default scale and offset
_DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")


@dataclass(frozen=True)
class CharacterFiles:
    """What transforms.json says: cameras (N,), their files, source cameras (V,), their files and names."""

    cameras: Cameras
    image_files: tuple[Path, ...]
    depth_files: tuple[Path, ...]
    source_cameras: Cameras
    source_files: tuple[Path, ...]
    source_names: tuple[str, ...]


def transforms_text(
    cameras: Cameras,
    image_names: Sequence[str],
    depth_names: Sequence[str],
    source_cameras: Cameras,
    source_files: Mapping[str, str],
) -> str:
    """The content of transforms.json.

    Args:
        cameras: Pinhole cameras (N,); where they differ in focal length or centre, each frame says its own.
        image_names: Files relative to the character's folder, N of them.
        depth_names: The same for depth, or none.
        source_cameras: Cameras (V,) of the source views.
        source_files: File of each source view by its name, in order, V of them.
    """
    alike = bool((cameras.focal == cameras.focal[0]).all()) and bool(
        (cameras.principal_point == cameras.principal_point[0]).all()
    )
    frames = [
        {"file_path": name, "transform_matrix": cameras.world_from_camera[index].tolist()}
        | ({"depth_file_path": depth_names[index]} if depth_names else {})
        | ({} if alike else _intrinsics(cameras[index]))
        for index, name in enumerate(image_names)
    ]
    sources = {
        name: {
            "file_path": file,
            "transform_matrix": source_cameras.world_from_camera[index].tolist(),
            "camera_model": "ORTHOGRAPHIC" if bool(source_cameras.orthographic[index]) else "PINHOLE",
            **_intrinsics(source_cameras[index]),
        }
        for index, (name, file) in enumerate(source_files.items())
    }
    content = {
        **(
            _intrinsics(cameras[0]) if alike else {}
        ),  # nerfstudio takes what stands here before what a frame says
        "k1": 0.0,
        "k2": 0.0,
        "p1": 0.0,
        "p2": 0.0,
        **(_angles(cameras[0]) if alike else {}),
        "aabb_scale": AABB_SCALE,
        "source_views": sources,
        "frames": frames,
    }
    return json.dumps(content, indent=1) + "\n"


def _angles(camera: Cameras) -> dict[str, float]:
    """Fields of view of a camera of shape (), radians."""
    focal_x, focal_y = camera.focal.tolist()
    return {
        "camera_angle_x": 2.0 * math.atan(0.5 * camera.width / focal_x),
        "camera_angle_y": 2.0 * math.atan(0.5 * camera.height / focal_y),
    }


def _intrinsics(camera: Cameras) -> dict[str, float]:
    """Size, focal lengths and centre of a camera of shape (), pixels."""
    (focal_x, focal_y), (centre_x, centre_y) = camera.focal.tolist(), camera.principal_point.tolist()
    return {
        "w": camera.width,
        "h": camera.height,
        "fl_x": focal_x,
        "fl_y": focal_y,
        "cx": centre_x,
        "cy": centre_y,
    }


def read_transforms(folder: Path) -> CharacterFiles:
    """Read transforms.json of a character.

    Args:
        folder: The character's folder.

    Returns:
        Cameras and files; every file named there exists.

    Raises:
        DataError: If a key or file is missing or a number or matrix is wrong; the message names file and key.
    """
    path = inside(folder, TRANSFORMS_FILE, str(folder))
    content = read_json(path)
    frames = content.get("frames")
    if not isinstance(frames, list) or not frames:
        raise DataError(f"{path}: frames: found {shown(frames)}, expected a list of at least one frame.")
    if len(frames) > MOST_FRAMES:
        raise DataError(f"{path}: frames: found {len(frames)}, expected at most {MOST_FRAMES}.")
    merged = [{**content, **section(path, f"frames[{index}]", frame)} for index, frame in enumerate(frames)]
    where = [f"{path}: frames[{index}]" for index in range(len(frames))]
    depth_keys = ["depth_file_path" in frame for frame in merged]
    if any(depth_keys) and not all(depth_keys):
        raise DataError(
            f"{where[depth_keys.index(False)]}: has no depth_file_path while others have; give all or none."
        )
    sources = section(path, "source_views", content.get("source_views", {}))
    if len(sources) > MOST_SOURCES:
        raise DataError(f"{path}: source_views: found {len(sources)}, expected at most {MOST_SOURCES}.")
    for name in sources:
        check_view_name(f"{path}: source_views", name)
    source_where = [f"{path}: source_views.{name}" for name in sources]
    source_frames = [section(path, f"source_views.{name}", source) for name, source in sources.items()]
    if not sources:
        raise DataError(
            f"{path}: has no source_views, expected at least one of front, side, back; capture it again."
        )
    return CharacterFiles(
        cameras=_cameras(where, merged),
        image_files=_files(folder, where, merged, "file_path"),
        depth_files=_files(folder, where, merged, "depth_file_path") if all(depth_keys) else (),
        source_cameras=_cameras(source_where, source_frames),
        source_files=_files(folder, source_where, source_frames, "file_path"),
        source_names=tuple(sources),
    )


def check_pose(where: str, matrix: Any) -> Tensor:
    """A 4x4 rigid pose as float64.

    Raises:
        DataError: If it is not 4x4, not finite, or its 3x3 part is no rotation.
    """
    try:
        pose = torch.tensor(matrix, dtype=torch.float64)
    except (TypeError, ValueError, RuntimeError, OverflowError) as err:
        raise DataError(f"{where}: found {shown(matrix)}, expected a 4x4 matrix of numbers.") from err
    if pose.shape != (4, 4):
        raise DataError(f"{where}: found shape {tuple(pose.shape)}, expected a 4x4 matrix.")
    if not bool(pose.isfinite().all()):
        raise DataError(f"{where}: holds NaN or infinity, expected finite numbers; write the camera again.")
    rotation = pose[:3, :3]
    off = float((rotation.T @ rotation - torch.eye(3, dtype=torch.float64)).abs().max())
    if off > 1e-3 or float(torch.linalg.det(rotation)) < 0.0:
        raise DataError(
            f"{where}: its 3x3 part is no rotation (off by {off:.2g}, determinant "
            f"{float(torch.linalg.det(rotation)):.3g}); "
            "expected world_from_camera of an OpenGL/Blender camera, without scale or mirroring."
        )
    last = pose.new_tensor((0.0, 0.0, 0.0, 1.0))
    if float((pose[3] - last).abs().max()) > 1e-6:
        raise DataError(f"{where}: found last row {pose[3].tolist()}, expected 0 0 0 1.")
    return pose


def _cameras(where: Sequence[str], frames: Sequence[Mapping[str, Any]]) -> Cameras:
    sizes = [
        (count(place, frame, "w"), count(place, frame, "h"))
        for place, frame in zip(where, frames, strict=True)
    ]
    for place, size in zip(where, sizes, strict=True):
        if size != sizes[0]:
            raise DataError(
                f"{place}: found w, h = {size}, the first has {sizes[0]}; expected one size, resize them."
            )
    width, height = sizes[0]
    focals, centres, poses, models = [], [], [], []
    for place, frame in zip(where, frames, strict=True):
        _refuse_distortion(place, frame)
        focals.append(focal_lengths(place, frame, width))
        centres.append((number(place, frame, "cx", 0.5 * width), number(place, frame, "cy", 0.5 * height)))
        poses.append(check_pose(f"{place}.transform_matrix", frame.get("transform_matrix")))
        models.append(_is_orthographic(place, frame))
    return Cameras(
        world_from_camera=torch.stack(poses).float(),
        focal=torch.tensor(focals, dtype=torch.float32),
        principal_point=torch.tensor(centres, dtype=torch.float32),
        orthographic=torch.tensor(models, dtype=torch.bool),
        width=width,
        height=height,
    )


def focal_lengths(where: str, frame: Mapping[str, Any], width: int) -> tuple[float, float]:
    """Focal lengths of a frame, pixels, said as such or as camera_angle_x, radians.

    Raises:
        DataError: If they are missing or not positive.
    """
    if "fl_x" not in frame and "camera_angle_x" in frame:
        angle = number(where, frame, "camera_angle_x", 0.0)
        if not 0.0 < angle < math.pi:
            raise DataError(f"{where}.camera_angle_x: found {angle}, expected radians between 0 and pi.")
        focal_x = 0.5 * width / math.tan(0.5 * angle)
    else:
        focal_x = number(where, frame, "fl_x", None)
    focal_y = number(where, frame, "fl_y", focal_x)
    if not (focal_x > 0.0 and focal_y > 0.0):
        raise DataError(f"{where}: found fl_x = {focal_x}, fl_y = {focal_y}, expected positive pixels.")
    return focal_x, focal_y


def _is_orthographic(where: str, frame: Mapping[str, Any]) -> bool:
    model = frame.get("camera_model", "PINHOLE")
    if model not in ("ORTHOGRAPHIC", "PINHOLE", "OPENCV"):
        raise DataError(f"{where}.camera_model: found {model!r}, expected PINHOLE or ORTHOGRAPHIC.")
    return model == "ORTHOGRAPHIC"


def _refuse_distortion(where: str, frame: Mapping[str, Any]) -> None:
    distortion = {key: frame[key] for key in _DISTORTION if frame.get(key)}
    if distortion:
        raise DataError(
            f"{where}: found lens distortion {distortion}, expected none; undistort the pictures first."
        )


def _files(
    folder: Path, where: Sequence[str], frames: Sequence[Mapping[str, Any]], key: str
) -> tuple[Path, ...]:
    files = []
    for place, frame in zip(where, frames, strict=True):
        name = frame.get(key)
        if not isinstance(name, str) or not name:
            raise DataError(f"{place}.{key}: found {shown(name)}, expected a file relative to {folder}.")
        file = inside(folder, name, f"{place}.{key}")
        if not file.suffix and not file.exists():
            file = inside(folder, f"{name}.png", f"{place}.{key}")
        if not file.is_file():
            raise DataError(
                f"{file}: no such file, named by {place}.{key}; restore it or capture the character again."
            )
        files.append(file)
    return tuple(files)
