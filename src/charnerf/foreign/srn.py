"""Scene representation networks' folders, as pixelNeRF reads them: rgb/, pose/ and intrinsics.txt of every object."""

from pathlib import Path
from typing import final

import numpy as np

from charnerf.data.transforms import MOST_FRAMES, check_pose
from charnerf.errors import DataError
from charnerf.files import inside, read_text
from charnerf.foreign.axes import opengl_of_opencv
from charnerf.foreign.base import NO_SPLITS, AbstractFormat, Found, Up, folders_in, found_in
from charnerf.foreign.shot import Shot, picture_size

INTRINSICS = "intrinsics.txt"
_MOST_TEXT = 2**16  # bytes of a file of a few numbers
_SPLIT_ENDINGS = ("train", "val", "test")


@final
class Srn(AbstractFormat):
    """An object is a folder; folders NAME_train, NAME_val, NAME_test of objects are splits.

    Poses are world_from_camera of OpenCV cameras; intrinsics.txt has focal length and centre in its first line and height and
    width, which may differ from the pictures', in its last.
    """

    title = "SRN (pixelNeRF's srn_cars and srn_chairs)"
    up: Up = "+z"

    def characters(self, root: Path) -> list[Found]:
        """Objects in the folder, in folders of splits, and one folder deeper, as srn_chairs has them."""
        if _is_object(root):
            return found_in([root])
        objects, others = _parted(root)
        found = found_in(objects, _split_of(root))
        for folder in others:
            objects, deeper = _parted(folder)
            found += found_in(objects, _split_of(folder))
            for place in deeper:
                found += found_in(_parted(place)[0], _split_of(folder))
        return found

    def shots(self, one: Found) -> list[Shot]:
        """Pictures and poses in the order of their names."""
        focal, centre, stated = _intrinsics(inside(one.folder, INTRINSICS, str(one.folder)))
        pictures, poses = (sorted(_visible(one.folder, sub)) for sub in ("rgb", "pose"))
        if [file.stem for file in pictures] != [file.stem for file in poses]:
            raise DataError(
                f"{one.folder}: found {len(pictures)} pictures in rgb/ and {len(poses)} poses in pose/, expected one of each name."
            )
        if not 1 <= len(pictures) <= MOST_FRAMES:
            raise DataError(f"{one.folder}/rgb: found {len(pictures)} pictures, expected 1 to {MOST_FRAMES}.")
        return [
            _shot(one.folder, picture, pose, focal, centre, stated)
            for picture, pose in zip(pictures, poses, strict=True)
        ]


def _shot(
    folder: Path,
    picture: Path,
    pose: Path,
    focal: float,
    centre: tuple[float, float],
    stated: tuple[float, float],
) -> Shot:
    picture, pose = (inside(folder, str(file.relative_to(folder)), str(folder)) for file in (picture, pose))
    numbers = numbers_of(pose)
    if len(numbers) != 16:
        raise DataError(f"{pose}: found {len(numbers)} numbers, expected 16, a 4x4 matrix.")
    size = picture_size(picture)
    x, y = size[0] / stated[0], size[1] / stated[1]
    return Shot(
        where=str(pose),
        file=picture,
        mask=None,
        pose=tuple(
            opengl_of_opencv(check_pose(str(pose), np.reshape(numbers, (4, 4)).tolist())).reshape(-1).tolist()
        ),
        size=size,
        focal=(focal * x, focal * y),
        centre=(centre[0] * x, centre[1] * y),
    )


def numbers_of(file: Path) -> list[float]:
    """The numbers of a text file.

    Raises:
        DataError: If it is missing or holds anything else.
    """
    try:
        return [float(word) for word in read_text(file, most=_MOST_TEXT).split()]
    except FileNotFoundError as error:
        raise DataError(f"{file}: no such file, expected numbers of a camera; restore it.") from error
    except ValueError as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{file}: found something else than numbers ({error}); write it again.") from error


def _intrinsics(file: Path) -> tuple[float, tuple[float, float], tuple[float, float]]:
    """Focal length, centre, and the width and height that both are for."""
    numbers = numbers_of(file)
    if len(numbers) < 6:
        raise DataError(
            f"{file}: found {len(numbers)} numbers, expected focal length, centre, .., height and width."
        )
    focal, height, width = numbers[0], numbers[-2], numbers[-1]
    if not (np.isfinite(numbers).all() and focal > 0.0 and height >= 1.0 and width >= 1.0):
        raise DataError(
            f"{file}: found focal length {focal} of {width} x {height} pixels, expected positive numbers."
        )
    return focal, (numbers[1], numbers[2]), (width, height)


def _is_object(folder: Path) -> bool:
    return (folder / INTRINSICS).is_file() and (folder / "rgb").is_dir() and (folder / "pose").is_dir()


def _parted(folder: Path) -> tuple[list[Path], list[Path]]:
    """The folders in a folder that are objects, and the others; objects, which hold hundreds of files, are not looked into."""
    inner = folders_in(folder)
    are = [_is_object(one) for one in inner]
    objects = [one for one, is_one in zip(inner, are, strict=True) if is_one]
    return objects, [one for one, is_one in zip(inner, are, strict=True) if not is_one]


def _split_of(folder: Path) -> str:
    ending = folder.name.rpartition("_")[2]
    return ending if ending in _SPLIT_ENDINGS else NO_SPLITS


def _visible(folder: Path, sub: str) -> list[Path]:
    return [file for file in (folder / sub).iterdir() if not file.name.startswith(".")]
