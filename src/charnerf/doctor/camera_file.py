"""transforms*.json read leniently: every wrong number is a finding, and what is right is kept."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from charnerf.data.json_values import MOST_PIXELS, shown
from charnerf.data.layout import read_json
from charnerf.data.transforms import MOST_FRAMES
from charnerf.doctor.finding import Finding
from charnerf.doctor.repairs import pose_command
from charnerf.doctor.views import View
from charnerf.errors import DataError
from charnerf.files import inside
from charnerf.foreign.shot import picture_size
from charnerf.wording import listed

_SQUARE_OFF = 1e-3  # of a rotation
_FOCALS_APART = 0.01  # share by which two that are one may differ, as rounded


@dataclass
class _Read:
    """Views and wrong entries of a file, by kind: keys, and what was found at the first."""

    folder: Path
    path: Path
    views: list[View] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    wrong: dict[str, list[tuple[str, str]]] = field(default_factory=dict)

    def note(self, kind: str, key: str, found: str) -> None:
        self.wrong.setdefault(kind, []).append((key, found))


def read_camera_file(folder: Path, path: Path) -> tuple[list[View], list[Finding]]:
    """Views of a transforms.json, and what is wrong in it.

    Raises:
        DataError: If it is no such file at all.
    """
    content = read_json(inside(folder, path.name, str(folder)))
    frames = content.get("frames")
    if not isinstance(frames, list) or not 1 <= len(frames) <= MOST_FRAMES:
        raise DataError(
            f"{path}: frames: found {shown(frames)}, expected a list of 1 to {MOST_FRAMES} frames."
        )
    read = _Read(folder, path)
    _compare_focals(read, content)
    for key, entry, is_source in _entries(content, frames):
        if isinstance(entry, dict):
            _add(read, key, entry if is_source else {**content, **entry}, is_source)
        else:
            read.note("missing entry", key, shown(entry))
    return read.views, list(_findings(read))


def _entries(content: Mapping[str, Any], frames: list[Any]) -> Iterator[tuple[str, Any, bool]]:
    for index, frame in enumerate(frames):
        yield f"frames[{index}]", frame, False
    sources = content.get("source_views")
    for name, source in sources.items() if isinstance(sources, dict) else ():
        yield f"source_views.{name}", source, True


def _add(read: _Read, key: str, entry: Mapping[str, Any], is_source: bool) -> None:
    """Add a view, or note why there is none."""
    file = _file(read, key, entry)
    size = None if file is None else _size(read, key, entry, file)
    matrix = _matrix(read, key, entry.get("transform_matrix"))
    focal = None if size is None else _focal(read, key, entry, size[0])
    if file is None or size is None or matrix is None or focal is None:
        return
    centre = tuple(
        _finite(entry.get(name), 0.5 * side) for name, side in zip(("cx", "cy"), size, strict=True)
    )
    mask, depth = entry.get("mask_path"), entry.get("depth_file_path")
    read.views.append(
        View(
            name=str(entry["file_path"])
            if not is_source
            else f"{key.partition('.')[2]} ({entry['file_path']})",
            file=file,
            key=f"{read.path}: {key}",
            matrix=matrix,
            focal=focal,
            centre=(centre[0], centre[1]),
            size=size,
            is_orthographic=entry.get("camera_model") == "ORTHOGRAPHIC",
            is_source=is_source,
            mask=_named(read.folder, mask, key) if isinstance(mask, str) else None,
            depth=_named(read.folder, depth, key) if isinstance(depth, str) else None,
        )
    )


def _file(read: _Read, key: str, entry: Mapping[str, Any]) -> Path | None:
    name = entry.get("file_path")
    if not isinstance(name, str) or not name:
        read.note("missing entry", f"{key}.file_path", shown(name))
        return None
    try:
        file = _named(read.folder, name, key)
        if not file.suffix and not file.is_file():
            file = _named(read.folder, f"{name}.png", key)
    except DataError as error:
        read.note("missing file", f"{key}.file_path", str(error))
        return None
    if not file.is_file():
        read.missing.append(str(file))
        return None
    return file


def _named(folder: Path, name: str, key: str) -> Path:
    return inside(folder, name, key)


def _size(read: _Read, key: str, entry: Mapping[str, Any], file: Path) -> tuple[int, int] | None:
    """Stated width and height, the picture's own where none are."""
    sides = [entry.get("w"), entry.get("h")]
    if None in sides:
        try:
            return picture_size(file)
        except DataError as error:
            read.note("truncated file", f"{key}.file_path", str(error))
            return None
    whole = [_finite(one, math.nan) for one in sides]
    if all(1.0 <= one <= MOST_PIXELS for one in whole):
        return int(whole[0]), int(whole[1])
    read.note("missing entry", f"{key}.w", shown(sides))
    return None


def _matrix(read: _Read, key: str, rows: Any) -> np.ndarray | None:
    """A pose as it is written, with its kind of fault noted; None where nothing can be made of it."""
    place = f"{key}.transform_matrix"
    try:
        matrix = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        read.note("missing entry", place, shown(rows))
        return None
    if matrix.shape == (3, 4):
        matrix = np.vstack((matrix, (0.0, 0.0, 0.0, 1.0)))
    if matrix.shape != (4, 4):
        read.note("missing entry", place, f"shape {matrix.shape}")
        return None
    if not np.isfinite(matrix).all():
        read.note("numbers that are not finite", place, f"{int((~np.isfinite(matrix)).sum())} of 16")
        return None
    last = np.array((0.0, 0.0, 0.0, 1.0))
    if np.abs(matrix[3] - last).max() > 1e-6 >= np.abs(matrix[:, 3] - last).max():
        read.note(
            "row for column",
            place,
            f"the last row {np.round(matrix[3], 3).tolist()}, and 0 0 0 1 as last column",
        )
        matrix = matrix.T
    rotation = matrix[:3, :3]
    determinant = float(np.linalg.det(rotation))
    off = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if determinant < 0.0:
        read.note("mirrored axes", place, f"determinant {determinant:.3g}")
        return None
    if off > _SQUARE_OFF:
        read.note(
            "scaled axes",
            place,
            f"columns of length {np.round(np.linalg.norm(rotation, axis=0), 4).tolist()}",
        )
        return None
    return matrix


def _focal(read: _Read, key: str, entry: Mapping[str, Any], width: int) -> tuple[float, float] | None:
    """Focal lengths, pixels, also by an angle, which may be in degrees."""
    angle, focal = _finite(entry.get("camera_angle_x"), math.nan), entry.get("fl_x")
    if focal is None and angle > 0.0:
        if angle >= math.pi:
            read.note("degrees for radians", f"{key}.camera_angle_x", f"{angle:g}")
            angle = math.radians(angle)
        return (0.5 * width / math.tan(0.5 * angle),) * 2 if angle < math.pi else None
    values = (_finite(focal, math.nan), _finite(entry.get("fl_y"), _finite(focal, math.nan)))
    if all(math.isfinite(one) and one > 0.0 for one in values):
        return values
    kind = "missing entry" if focal is None or min(values) <= 0.0 else "numbers that are not finite"
    read.note(kind, f"{key}.fl_x", f"{shown(focal)}, {shown(entry.get('fl_y'))}")
    return None


def _compare_focals(read: _Read, content: Mapping[str, Any]) -> None:
    """Note where the angle and the focal length that a file states for all are not one: programs read the one or the other."""
    angle, focal, width = (_finite(content.get(key), math.nan) for key in ("camera_angle_x", "fl_x", "w"))
    if not (focal > 0.0 and width > 0.0 and angle > 0.0):
        return
    if angle >= math.pi:
        read.note("degrees for radians", "camera_angle_x", f"{angle:g}")
        return
    by_angle = 0.5 * width / math.tan(0.5 * angle)
    if abs(by_angle / focal - 1.0) > _FOCALS_APART:
        found = f"{angle:.4g}, by which fl_x is {by_angle:.4g}, beside fl_x {focal:.4g}"
        read.note("contradicting focal lengths", "camera_angle_x", found)


def _finite(value: Any, default: float) -> float:
    if value is None:
        return default
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e30
    return float(value) if is_number else math.nan


_EXPECTED = {
    "missing entry": ("what the format asks for", "Write the entry, or take the frame out."),
    "truncated file": ("a picture that opens whole", "Copy it again, or capture the character again."),
    "missing file": ("a file inside the character's folder", "Copy it there."),
    "numbers that are not finite": (
        "finite numbers",
        "Write these cameras anew; what made them divided by zero or lost them.",
    ),
    "row for column": ("0 0 0 1 as last row", "Transpose the matrices."),
    "mirrored axes": (
        "a rotation of determinant 1",
        "One axis is flipped: negate the column that the exporter mirrored.",
    ),
    "scaled axes": (
        "columns of length 1",
        "Divide the columns by their lengths: a scaled object was exported as a camera.",
    ),
    "contradicting focal lengths": (
        "one field of view",
        "Leave out the wrong one of camera_angle_x and fl_x.",
    ),
    "degrees for radians": ("radians between 0 and pi", "Divide by 180 and multiply by pi."),
}


def _findings(read: _Read) -> Iterator[Finding]:
    for kind, entries in read.wrong.items():
        expected, fix = _EXPECTED[kind]
        found = listed([value for _, value in entries], 1)
        yield Finding(
            kind, f"{read.path}: {entries[0][0]}", found, expected, fix, pose_command(kind, read.path)
        )
    if read.missing:
        yield Finding(
            "missing file",
            str(read.path),
            f"no {listed(read.missing, 1)}",
            f"every picture that {read.path.name} names",
            "Restore them, or capture the character again.",
            "charnerf capture MESH -o DATASET --split SPLIT",
        )
