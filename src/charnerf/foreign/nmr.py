"""Renderings of the neural mesh renderer, as DVR and pixelNeRF read them: image/, mask/ and cameras.npz of every object."""

import io
import zipfile
from pathlib import Path
from typing import Any, final

import numpy as np

from charnerf.data.transforms import MOST_FRAMES, check_pose
from charnerf.errors import DataError
from charnerf.files import inside, read_bytes, read_text
from charnerf.foreign.axes import opengl_of_opencv
from charnerf.foreign.base import AbstractFormat, Found, Up, folders_in, found_in, name_of
from charnerf.foreign.shot import Shot, picture_size

CAMERAS = "cameras.npz"
_MOST_BYTES = 64 * 2**20
_LISTS = {"train": "softras_train.lst", "val": "softras_val.lst", "test": "softras_test.lst"}
_PICTURES = (".png", ".jpg", ".jpeg")


@final
class Nmr(AbstractFormat):
    """An object is a folder; a category is a folder of objects with lists of its splits, a data set one of categories.

    Cameras are OpenCV's; camera_mat_N is for pictures that span [-1, 1], world_mat_N is camera_from_world. Worlds are Y up.
    """

    title = "NMR (pixelNeRF's ShapeNet renderings)"
    up: Up = "+y"

    def characters(self, root: Path) -> list[Found]:
        """An object, a category, or categories."""
        if _is_object(root):
            return found_in([root])
        listed = [one for folder in (root, *folders_in(root)) for one in _listed(folder)]
        if listed:
            return listed
        below = [one for folder in folders_in(root) for one in folders_in(folder)]
        return found_in(filter(_is_object, (*folders_in(root), *below)))

    def shots(self, one: Found) -> list[Shot]:
        """Pictures in the order of their names; the Nth has the cameras of number N."""
        where = inside(one.folder, CAMERAS, str(one.folder))
        matrices = _matrices(where)
        pictures, masks = _pictures(one.folder, "image"), _pictures(one.folder, "mask")
        if not 1 <= len(pictures) <= MOST_FRAMES or len(masks) not in (0, len(pictures)):
            raise DataError(
                f"{one.folder}: found {len(pictures)} pictures and {len(masks)} masks, expected 1 to {MOST_FRAMES}, and as many"
                " masks or none."
            )
        return [
            _shot(where, number, picture, masks[number] if masks else None, matrices)
            for number, picture in enumerate(pictures)
        ]


def _shot(
    where: Path, number: int, picture: Path, mask: Path | None, matrices: dict[str, np.ndarray]
) -> Shot:
    size = picture_size(picture)
    camera = _matrix(where, f"camera_mat_{number}", matrices)
    inverse = f"world_mat_inv_{number}"
    if inverse in matrices:
        pose = _matrix(where, inverse, matrices)
    else:
        pose = np.linalg.inv(_matrix(where, f"world_mat_{number}", matrices))
    focal = (float(camera[0, 0]) * size[0] / 2.0, float(camera[1, 1]) * size[1] / 2.0)
    if not min(focal) > 0.0:
        raise DataError(f"{where}: camera_mat_{number}: found focal lengths {focal}, expected positive ones.")
    return Shot(
        where=f"{where}: {number}",
        file=picture,
        mask=mask,
        pose=tuple(
            opengl_of_opencv(check_pose(f"{where}: world_mat_{number}", pose.tolist())).reshape(-1).tolist()
        ),
        size=size,
        focal=focal,
        centre=((float(camera[0, 2]) + 1.0) * size[0] / 2.0, (float(camera[1, 2]) + 1.0) * size[1] / 2.0),
    )


def _matrices(file: Path) -> dict[str, np.ndarray]:
    """Arrays of numbers of an NPZ, which may hold no objects: those would run code."""
    try:
        content = io.BytesIO(read_bytes(file, most=_MOST_BYTES))
        with zipfile.ZipFile(content) as members:
            unpacked = sum(one.file_size for one in members.infolist())
        if unpacked > _MOST_BYTES:
            raise DataError(f"{file}: found {unpacked} bytes once unpacked, expected at most {_MOST_BYTES}.")
        with np.load(content, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError as error:
        raise DataError(f"{file}: no such file, expected the cameras of the pictures.") from error
    except Exception as error:  # zip files of strangers fail in every way
        if isinstance(error, DataError):
            raise
        raise DataError(f"{file}: can not be read as an NPZ ({error}); restore it.") from error


def _matrix(where: Path, key: str, matrices: dict[str, Any]) -> np.ndarray:
    """A 4x4 matrix, of which the last row may be missing."""
    if key not in matrices:
        raise DataError(f"{where}: has no {key}, expected one for every picture.")
    found = matrices[key]
    matrix = np.eye(4)
    is_matrix = (
        found.dtype.kind in "fiu" and found.shape in ((3, 3), (3, 4), (4, 4)) and np.isfinite(found).all()
    )
    if not is_matrix:
        raise DataError(f"{where}: {key}: found {found.dtype} {found.shape}, expected a finite 4x4 matrix.")
    matrix[: found.shape[0], : found.shape[1]] = found
    if abs(np.linalg.det(matrix)) < 1e-12:
        raise DataError(f"{where}: {key}: found a singular matrix, expected a camera's.")
    return matrix


def _listed(category: Path) -> list[Found]:
    found = []
    for split, name in _LISTS.items():
        if (category / name).is_file():
            try:
                lines = read_text(category / name).split()
            except UnicodeDecodeError as error:
                raise DataError(f"{category / name}: is no text ({error}); restore it.") from error
            for line in lines:
                folder = inside(category, line, str(category / name))
                if _is_object(folder):
                    found.append(Found(name_of(f"{category.name}-{line}"), split, folder))
    return found


def _is_object(folder: Path) -> bool:
    return (folder / CAMERAS).is_file() and (folder / "image").is_dir()


def _pictures(folder: Path, sub: str) -> list[Path]:
    if not (folder / sub).is_dir():
        return []
    names = sorted(
        f"{sub}/{file.name}" for file in (folder / sub).iterdir() if file.suffix.lower() in _PICTURES
    )
    return [inside(folder, name, str(folder)) for name in names]
