"""One picture of a foreign data set with its camera, brought onto a square canvas."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor
from torch.nn import functional as F

from charnerf.data.characters import read_rgba
from charnerf.errors import DataError
from charnerf.foreign.lens import Lens, undistorted
from charnerf.geometry.resizing import resized_pictures
from charnerf.pictures import open_picture

BORDER_WHITE = 0.5  # share of a picture's border that is white where the background is
OPAQUE_ALPHA = 255


@dataclass(frozen=True)
class Shot:
    """A picture and the camera that took it.

    Attributes:
        where: File and key that name it, for messages.
        file: The picture.
        mask: Picture whose white shows the character, None where the picture has alpha or a white background.
        pose: world_from_camera, 16 numbers row by row, OpenGL camera, in the data set's own world.
        size: Width and height of the picture, pixels.
        focal: Along x and y, pixels.
        centre: Principal point, pixels; pixel centres at +0.5.
        lens: Its distortion, None of a pinhole.
    """

    where: str
    file: Path
    mask: Path | None
    pose: tuple[float, ...]
    size: tuple[int, int]
    focal: tuple[float, float]
    centre: tuple[float, float]
    lens: Lens | None = None


@dataclass(frozen=True)
class Canvas:
    """A picture on a square.

    Attributes:
        rgba: uint8 (S, S, 4), straight alpha.
        focal: Along x and y, pixels of the square.
        centre: Principal point, pixels of the square.
    """

    rgba: Tensor
    focal: tuple[float, float]
    centre: tuple[float, float]


def on_canvas(shot: Shot, side: int) -> Canvas:
    """A shot without its lens' distortion, scaled so that its longer side fills a square, in the middle of it.

    Raises:
        DataError: If a file can not be read, is of another size, or does not tell figure from background.
    """
    picture = _read(shot)
    if shot.lens is not None:
        picture = undistorted(picture, shot.focal, shot.centre, shot.lens, shot.where)
    width, height = shot.size
    shrink = side / max(width, height)
    wide, tall = max(1, round(width * shrink)), max(1, round(height * shrink))
    small = resized_pictures(picture.permute(2, 0, 1)[None], wide, tall)[0].clamp(0.0, 1.0)
    left, top = (side - wide) // 2, (side - tall) // 2
    square = F.pad(small, (left, side - wide - left, top, side - tall - top))
    straight = torch.cat((square[:3] / square[3:].clamp_min(1e-6), square[3:])).clamp(0.0, 1.0)
    x, y = wide / width, tall / height
    return Canvas(
        rgba=(255.0 * straight).round().to(torch.uint8).permute(1, 2, 0).contiguous(),
        focal=(shot.focal[0] * x, shot.focal[1] * y),
        centre=(shot.centre[0] * x + left, shot.centre[1] * y + top),
    )


def picture_size(file: Path) -> tuple[int, int]:
    """Width and height of a picture, pixels, by its header.

    Raises:
        DataError: If it is missing or no picture.
    """
    try:
        with open_picture(file) as picture:
            return picture.size
    except FileNotFoundError as error:
        raise DataError(f"{file}: no such file; restore it or take it out of the list of frames.") from error
    except (OSError, SyntaxError, ValueError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{file}: can not be read as a picture ({error}); restore it.") from error


def read_mask(file: Path, size: tuple[int, int]) -> Tensor:
    """A mask (H, W) in [0, 1], white where the figure is.

    Args:
        file: A picture of any depth.
        size: Width and height that it has to have, pixels.

    Raises:
        DataError: If it is missing, no picture, or of another size.
    """
    found = picture_size(file)
    if found != size:
        raise DataError(
            f"{file}: found {found[0]} x {found[1]} pixels, expected {size[0]} x {size[1]} as its picture has."
        )
    try:
        with open_picture(file) as picture:
            grey = np.asarray(picture.convert("L"), dtype=np.float32)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise DataError(f"{file}: can not be read as a picture ({error}); restore it.") from error
    return torch.from_numpy(grey / OPAQUE_ALPHA)


def _read(shot: Shot) -> Tensor:
    """Colours times alpha, and alpha, (H, W, 4) in [0, 1]."""
    rgba = read_rgba(shot.file, shot.size).float() / 255.0
    if shot.mask is not None:
        alpha = rgba[..., 3] * read_mask(shot.mask, shot.size)
    elif bool((rgba[..., 3] < 1.0).any()):
        alpha = rgba[..., 3]
    else:
        alpha = _beside_white(rgba[..., :3], shot)
    return torch.cat((rgba[..., :3] * alpha[..., None], alpha[..., None]), dim=-1)


def _beside_white(rgb: Tensor, shot: Shot) -> Tensor:
    """Alpha (H, W) of a picture on pure white, as renderings of ShapeNet have it (so pixelNeRF reads them)."""
    white = (rgb == 1.0).all(-1)
    border = torch.cat((white[0], white[-1], white[:, 0], white[:, -1]))
    if float(border.float().mean()) < BORDER_WHITE:
        raise DataError(
            f"{shot.file}: is opaque everywhere and not on white, expected alpha, a mask or a white background: without, figure and"
            f" background are one. Add a mask ({shot.where})."
        )
    return (~white).float()
