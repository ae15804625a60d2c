"""CO3D's frame_annotations, and files of their form: sequences of pictures with masks and PyTorch3D cameras.

Mapping: a sequence is a character; image.path, mask.path are relative to the data set; viewpoint.R, .T: x_camera = x_world R + T
with +X left, +Y up, +Z ahead; focal_length and principal_point in NDC, `ndc_isotropic` (over half the shorter side, as CO3D's
second version) or `ndc_norm_image_bounds` (over half of each side). Worlds are y down.
"""

import gzip
import json
import zlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, final

import numpy as np
import torch

from charnerf.data.json_values import check_commas, number, section, shown
from charnerf.data.transforms import MOST_FRAMES, check_pose
from charnerf.errors import DataError
from charnerf.files import inside, open_regular
from charnerf.foreign.base import NO_SPLITS, AbstractFormat, Found, Up, folders_in, name_of
from charnerf.foreign.shot import Shot, picture_size

FILES = ("frame_annotations.jgz", "frame_annotations.json")
_MOST_BYTES = 2**30  # of the text
_FORMATS = ("ndc_isotropic", "ndc_norm_image_bounds")
Frames = Mapping[str, list[tuple[int, dict[str, Any]]]]


@final
class Co3d(AbstractFormat):
    """A category is a folder with frame_annotations; a data set a folder of categories, which pictures' paths are relative to."""

    title = "CO3D (frame_annotations.jgz)"
    up: Up = "-y"

    def characters(self, root: Path) -> list[Found]:
        """Sequences of the category, or of all categories."""
        found = []
        for folder in (root, *folders_in(root)):
            file = _annotations(folder)
            if file is not None:
                found += [
                    Found(name_of(f"{folder.name}-{sequence}"), NO_SPLITS, folder, sequence)
                    for sequence in _frames(file, file.stat().st_mtime_ns)
                ]
        return found

    def shots(self, one: Found) -> list[Shot]:
        """Frames of a sequence by their numbers."""
        file = _annotations(one.folder)
        if file is None:
            raise DataError(f"{one.folder}: has no {FILES[0]} any more; restore it.")
        frames = _frames(file, file.stat().st_mtime_ns)[one.part]
        if len(frames) > MOST_FRAMES:
            raise DataError(
                f"{file}: {one.part}: found {len(frames)} frames, expected at most {MOST_FRAMES}."
            )
        return [_shot(one.folder, f"{file}: [{index}]", frame) for index, frame in frames]


def _shot(category: Path, where: str, frame: dict[str, Any]) -> Shot:
    image, mask = frame.get("image"), frame.get("mask")
    file = _file(category, f"{where}.image.path", image)
    size = picture_size(file)
    view = section(Path(where), "viewpoint", frame.get("viewpoint"))
    focal, centre = _intrinsics(where, view, size)
    return Shot(
        where=where,
        file=file,
        mask=None if mask is None else _file(category, f"{where}.mask.path", mask),
        pose=_pose(where, view),
        size=size,
        focal=focal,
        centre=centre,
    )


def _pose(where: str, view: Mapping[str, Any]) -> tuple[float, ...]:
    """Ours of x_camera = x_world R + T: a camera turned by half a turn about its y axis."""
    try:
        rotation, shift = np.array(view.get("R"), dtype=np.float64), np.array(view.get("T"), dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise DataError(
            f"{where}.viewpoint: found R {shown(view.get('R'))}, expected 3x3 numbers and T of 3."
        ) from error
    if rotation.shape != (3, 3) or shift.shape != (3,):
        raise DataError(
            f"{where}.viewpoint: found R {rotation.shape} and T {shift.shape}, expected (3, 3) and (3,)."
        )
    pose = np.eye(4)
    pose[:3, :3] = rotation @ np.diag((-1.0, 1.0, -1.0))
    pose[:3, 3] = -rotation @ shift
    return tuple(check_pose(f"{where}.viewpoint.R", pose.tolist()).reshape(-1).tolist())


def _intrinsics(
    where: str, view: Mapping[str, Any], size: tuple[int, int]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Focal lengths and centre, pixels."""
    kind = view.get("intrinsics_format", "ndc_norm_image_bounds")
    if kind not in _FORMATS:
        raise DataError(
            f"{where}.viewpoint.intrinsics_format: found {shown(kind)}, expected {' or '.join(_FORMATS)}."
        )
    halves = torch.tensor(size, dtype=torch.float64) / 2.0
    units = halves.amin().expand(2) if kind == _FORMATS[0] else halves
    pairs = []
    for key in ("focal_length", "principal_point"):
        values = view.get(key)
        if not isinstance(values, list) or len(values) != 2:
            raise DataError(f"{where}.viewpoint.{key}: found {shown(values)}, expected two numbers.")
        read = [
            number(f"{where}.viewpoint.{key}", {str(one): value}, str(one), None)
            for one, value in enumerate(values)
        ]
        pairs.append(torch.tensor(read, dtype=torch.float64) * units)
    focal, principal = pairs
    if not bool((focal > 0.0).all()):
        raise DataError(
            f"{where}.viewpoint.focal_length: found {focal.tolist()} pixels, expected positive ones."
        )
    centre = halves - principal  # NDC have +X left and +Y up
    return (float(focal[0]), float(focal[1])), (float(centre[0]), float(centre[1]))


def _file(category: Path, where: str, entry: Any) -> Path:
    """A file of an entry with `path`: relative to the data set, so that it begins with the category's name."""
    path = entry.get("path") if isinstance(entry, dict) else None
    if not isinstance(path, str) or not path:
        raise DataError(f"{where}: found {shown(path)}, expected a file's name.")
    return inside(category, path.removeprefix(f"{category.name}/"), where)


def _annotations(folder: Path) -> Path | None:
    there = [name for name in FILES if (folder / name).is_file()]
    return inside(folder, there[0], str(folder)) if there else None


@lru_cache(maxsize=4)
def _frames(file: Path, changed: int) -> Frames:
    """Frames by sequence, with their places in the file; kept, since one file holds thousands of sequences."""
    try:
        with open_regular(file) as raw:
            stream = gzip.GzipFile(fileobj=raw) if file.suffix == ".jgz" else raw
            text = stream.read(_MOST_BYTES + 1)
        if len(text) > _MOST_BYTES:
            raise DataError(f"{file}: found more than {_MOST_BYTES} bytes of text, expected fewer.")
        check_commas(text.count(b","), str(file))
        content = json.loads(text)
    except (OSError, EOFError, zlib.error, ValueError, RecursionError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{file}: can not be read as JSON ({error}); restore it.") from error
    if not isinstance(content, list):
        raise DataError(f"{file}: found a JSON {type(content).__name__}, expected a list of frames.")
    frames: dict[str, list[tuple[int, dict[str, Any]]]] = {}
    for index, entry in enumerate(content):
        frame = section(file, f"[{index}]", entry)
        sequence = frame.get("sequence_name")
        if not isinstance(sequence, str) or not sequence:
            raise DataError(f"{file}: [{index}].sequence_name: found {shown(sequence)}, expected a name.")
        frames.setdefault(sequence, []).append((index, frame))
    for members in frames.values():
        members.sort(key=lambda pair: number(f"{file}: [{pair[0]}]", pair[1], "frame_number", float(pair[0])))
    return frames
