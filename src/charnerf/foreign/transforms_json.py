"""transforms.json of nerfstudio and instant-ngp, NeRF-Blender's transforms_train.json, pixelNeRF's folders of such."""

import logging
import math
from pathlib import Path
from typing import Any, final

from charnerf.data.json_values import count, number, section, shown
from charnerf.data.layout import read_json
from charnerf.data.transforms import MOST_FRAMES, check_pose, focal_lengths
from charnerf.errors import DataError
from charnerf.files import inside
from charnerf.foreign.base import AbstractFormat, Found, Up, folders_in, found_in
from charnerf.foreign.lens import Lens
from charnerf.foreign.shot import Shot, picture_size

log = logging.getLogger(__name__)

SPLITS = ("train", "val", "test")
_CAMERA = {
    "w",
    "h",
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "camera_angle_x",
    "camera_angle_y",
    "camera_model",
    "is_fisheye",
}
_LENS = {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"}
_FRAME = {"file_path", "transform_matrix", "mask_path"}
_WITHOUT_EFFECT = {  # on pictures and cameras, as they are read here
    *(
        "frames",
        "source_views",
        "aabb_scale",
        "scale",
        "offset",
        "up",
        "render_aabb",
        "n_extra_learnable_dims",
    ),
    *(
        "applied_transform",
        "applied_scale",
        "orientation_override",
        "auto_scale_poses_override",
        "ply_file_path",
    ),
    *(
        "train_filenames",
        "val_filenames",
        "test_filenames",
        "sharpness",
        "rotation",
        "colmap_im_id",
        "depth_file_path",
    ),
    *("enable_depth_loading", "integer_depth_scale", "from_na", "white_transparent", "black_transparent"),
}
_KNOWN = _CAMERA | _LENS | _FRAME | _WITHOUT_EFFECT
_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "PERSPECTIVE", "SIMPLE_RADIAL", "RADIAL")


@final
class TransformsJson(AbstractFormat):
    """A folder with transforms*.json is a character; a folder of such folders a data set, of folders train, val, test its splits.

    Several files of a folder are read one after the other: train, val, test, then others by name. Their frames count on.
    """

    title = "transforms.json (nerfstudio, instant-ngp, NeRF-Blender, pixelNeRF)"
    up: Up = "+z"

    def characters(self, root: Path) -> list[Found]:
        """The folder itself, or those in it."""
        if camera_files(root):
            return found_in([root])
        split_folders = [root / split for split in SPLITS if (root / split).is_dir()]
        if split_folders:
            return [one for folder in split_folders for one in found_in(_with_files(folder), folder.name)]
        return found_in(_with_files(root))

    def shots(self, one: Found) -> list[Shot]:
        """Frames of all files; one picture counts once."""
        shots: dict[Path, Shot] = {}
        unknown: set[str] = set()
        for path in camera_files(one.folder):
            content = read_json(inside(one.folder, path.name, str(one.folder)))
            frames = content.get("frames")
            if not isinstance(frames, list) or not 1 <= len(frames) <= MOST_FRAMES:
                raise DataError(
                    f"{path}: frames: found {shown(frames)}, expected a list of 1 to {MOST_FRAMES} frames."
                )
            unknown |= content.keys() - _KNOWN
            for index, frame in enumerate(frames):
                own = section(path, f"frames[{index}]", frame)
                unknown |= own.keys() - _KNOWN
                shot = _shot(one.folder, f"{path}: frames[{index}]", {**content, **own})
                shots.setdefault(shot.file, shot)
        if unknown:
            log.warning(
                "%s: keys %s are not understood and left aside.", one.folder, ", ".join(sorted(unknown))
            )
        return list(shots.values())


def camera_files(folder: Path) -> list[Path]:
    """The transforms*.json of a folder, in the order that views are counted."""
    order = {
        f"transforms{suffix}.json": place for place, suffix in enumerate(("", "_train", "_val", "_test"))
    }
    files = [one for one in folder.glob("transforms*.json") if one.is_file()]
    return sorted(files, key=lambda file: (order.get(file.name, len(order)), file.name))


def _with_files(folder: Path) -> list[Path]:
    return [one for one in folders_in(folder) if camera_files(one)]


def _shot(folder: Path, where: str, frame: dict[str, Any]) -> Shot:
    _refuse_other_cameras(where, frame)
    file = _picture(folder, where, frame)
    mask = frame.get("mask_path")
    size = (
        (count(where, frame, "w"), count(where, frame, "h"))
        if {"w", "h"} <= frame.keys()
        else picture_size(file)
    )
    lens = Lens(**{key: number(where, frame, key, 0.0) for key in ("k1", "k2", "k3", "p1", "p2")})
    pose = check_pose(f"{where}.transform_matrix", _four_rows(frame.get("transform_matrix")))
    return Shot(
        where=where,
        file=file,
        mask=None if mask is None else inside(folder, _text(where, "mask_path", mask), f"{where}.mask_path"),
        pose=tuple(pose.reshape(-1).tolist()),
        size=size,
        focal=_focal(where, frame, size),
        centre=(number(where, frame, "cx", 0.5 * size[0]), number(where, frame, "cy", 0.5 * size[1])),
        lens=None if lens == Lens() else lens,
    )


def _focal(where: str, frame: dict[str, Any], size: tuple[int, int]) -> tuple[float, float]:
    """Focal lengths; camera_angle_y counts where no fl_y is said."""
    focal_x, focal_y = focal_lengths(where, frame, size[0])
    if not {"fl_x", "fl_y"} & frame.keys() and "camera_angle_y" in frame:
        angle = number(where, frame, "camera_angle_y", None)
        if not 0.0 < angle < math.pi:
            raise DataError(f"{where}.camera_angle_y: found {angle}, expected radians between 0 and pi.")
        focal_y = 0.5 * size[1] / math.tan(0.5 * angle)
    return focal_x, focal_y


def _picture(folder: Path, where: str, frame: dict[str, Any]) -> Path:
    """The picture of a frame: as it is named, with .png, or as pixelNeRF's folders have it, NAME_obj.png beside the JSON."""
    name = _text(where, "file_path", frame.get("file_path"))
    key = f"{where}.file_path"
    stem = Path(name).stem
    tried = [inside(folder, name, key)]
    if not Path(name).suffix:
        tried.append(inside(folder, f"{name}.png", key))
    tried.append(inside(folder, f"{stem}_obj.png", key))
    for file in tried:
        if file.is_file():
            return file
    raise DataError(f"{tried[0]}: no such file, named by {key}; restore it or take the frame out.")


def _refuse_other_cameras(where: str, frame: dict[str, Any]) -> None:
    model = frame.get("camera_model", "PINHOLE")
    if model not in _PINHOLES or frame.get("is_fisheye"):
        found = "is_fisheye" if frame.get("is_fisheye") else repr(model)
        raise DataError(
            f"{where}.camera_model: found {found}, expected one of {', '.join(_PINHOLES)}; undistort the pictures first."
        )
    rational = {key: frame[key] for key in ("k4", "k5", "k6") if frame.get(key)}
    if rational:
        raise DataError(
            f"{where}: found lens distortion {rational}, expected k1, k2, k3, p1, p2 alone; undistort the pictures first."
        )


def _four_rows(matrix: Any) -> Any:
    """A matrix of three rows with its fourth, as instant-ngp takes it."""
    return [*matrix, [0.0, 0.0, 0.0, 1.0]] if isinstance(matrix, list) and len(matrix) == 3 else matrix


def _text(where: str, key: str, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise DataError(f"{where}.{key}: found {shown(value)}, expected a file's name.")
    return value
