"""Reading picture files of any kind, size and crop; what can not be used is said with the file's name."""

import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageCms, ImageOps, UnidentifiedImageError

from charnerf.errors import DataError
from charnerf.pictures import check_pixels, open_picture

SMALLEST = 16  # pixels a side
LONGEST = 50  # sides of a picture over its other sides
LOSSY = ("JPEG", "MPO", "WEBP", "JPEG2000", "AVIF")
_PROFILED = ("RGB", "RGBA", "CMYK", "L")  # modes whose profile is of the pixels as they are
WORKING = 1536  # pixels; a longer side is reduced to this at once


@dataclass(frozen=True)
class Drawing:
    """A picture as it was read.

    Attributes:
        rgba: (H, W, 4), float32 in [0, 1], sRGB-encoded, straight alpha; reduced to at most WORKING pixels a
            side.
        name: What to call it in messages: the file's path.
        size: Width and height of the file, pixels.
        lossy: Whether the file's format may have blurred flat colours (JPEG, WebP).
    """

    rgba: np.ndarray
    name: str
    size: tuple[int, int]
    lossy: bool


def load_drawing(path: str | Path) -> Drawing:
    """Read a picture file.

    Args:
        path: PNG, JPEG, WebP or another of `pictures.FORMATS`; of an animation the first frame.

    Raises:
        DataError: If the file is missing, empty, broken, no picture, too large, too small or fully
            transparent.
    """
    path = Path(path)
    if not path.is_file():
        what = "a folder" if path.is_dir() else "a pipe or device" if path.exists() else "nothing"
        raise DataError(f"{path}: found {what}, expected a picture file (PNG, JPEG, WebP). Check the path.")
    if path.stat().st_size == 0:
        raise DataError(f"{path}: found an empty file of 0 bytes, expected a picture. Export it again.")
    try:
        with open_picture(path) as picture:
            size, lossy = picture.size, picture.format in LOSSY
            _check_size(str(path), size)
            rgba = _to_rgba(picture, str(path))
    except UnidentifiedImageError as err:
        raise DataError(
            f"{path}: found a file that is no picture, expected PNG, JPEG or WebP. Export it again."
        ) from err
    except (OSError, SyntaxError, ValueError, EOFError) as err:
        if isinstance(err, DataError):
            raise
        raise DataError(
            f"{path}: found a broken picture ({err}), expected one that opens whole. Export it again."
        ) from err
    return _checked(rgba, str(path), size, lossy)


def drawing_from_array(rgba: np.ndarray, name: str) -> Drawing:
    """Take a picture that is in memory already.

    Args:
        rgba: (H, W, 3) or (H, W, 4), uint8, or float in [0, 1].
        name: What to call it in messages.

    Raises:
        DataError: If the shape or the numbers are no picture's.
    """
    rgba = np.asarray(rgba)
    if rgba.ndim != 3 or rgba.shape[2] not in (3, 4):
        raise DataError(f"{name}: found an array of shape {rgba.shape}, expected (H, W, 3) or (H, W, 4).")
    values = rgba.astype(np.float32) / (255.0 if rgba.dtype == np.uint8 else 1.0)
    if not np.isfinite(values).all() or values.min() < 0.0 or values.max() > 1.0:
        raise DataError(f"{name}: found values outside of [0, 1], expected floats in [0, 1] or uint8.")
    if values.shape[2] == 3:
        values = np.concatenate((values, np.ones_like(values[..., :1])), axis=2)
    size = (rgba.shape[1], rgba.shape[0])
    _check_size(name, size)
    picture = Image.fromarray(np.round(255 * values).astype(np.uint8), "RGBA")
    return _checked(_reduce(picture) if max(size) > WORKING else values, name, size, False)


def _checked(rgba: np.ndarray, name: str, size: tuple[int, int], lossy: bool) -> Drawing:
    if float(rgba[..., 3].max()) < 0.02:
        raise DataError(
            f"{name}: found a fully transparent picture, expected a visible figure. Export it with its "
            "layers on."
        )
    return Drawing(rgba, name, size, lossy)


def _check_size(name: str, size: tuple[int, int]) -> None:
    width, height = size
    check_pixels(name, size)
    if min(width, height) < SMALLEST:
        raise DataError(
            f"{name}: found {width} x {height} pixels, expected at least {SMALLEST} a side. Use a larger "
            "picture."
        )
    if max(width, height) > LONGEST * min(width, height):
        raise DataError(
            f"{name}: found {width} x {height} pixels, expected one side at most {LONGEST} times the other. Crop the "
            "picture."
        )


def _to_srgb(picture: Image.Image, name: str) -> Image.Image:
    """The picture with colours as sRGB has them, where it brings another profile.

    Raises:
        DataError: If the profile can not be read.
    """
    profile = picture.info.get("icc_profile")
    if not profile or picture.mode not in _PROFILED:
        return picture
    try:
        given = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        if "srgb" in ImageCms.getProfileDescription(given).lower():
            return picture
        mode = "RGBA" if picture.mode == "RGBA" else "RGB"
        converted = ImageCms.profileToProfile(picture, given, ImageCms.createProfile("sRGB"), outputMode=mode)
    except (ImageCms.PyCMSError, OSError) as err:
        raise DataError(
            f"{name}: found a colour profile that can not be used ({err}), expected one of its colours, or none. Export it"
            " again as sRGB."
        ) from err
    assert converted is not None  # only with inPlace
    return converted


def _to_rgba(picture: Image.Image, name: str) -> np.ndarray:
    """Decode to (H, W, 4) float32 sRGB, turned as the camera's note says, 16-bit and float grey scaled."""
    picture.draft("RGB", (WORKING, WORKING))  # JPEG only: decodes a large one reduced
    turned = _to_srgb(ImageOps.exif_transpose(picture), name)
    if turned.mode.startswith("I") or turned.mode == "F":
        grey = np.asarray(turned, np.float64)
        most = grey.max()
        if not np.isfinite(grey).all():
            raise DataError(
                f"{name}: found pixels that are no finite numbers, expected grey values. Export it again as PNG."
            )
        scale = 65535.0 if most > 255.0 else 1.0 if turned.mode == "F" and most <= 1.0 else 255.0
        turned = Image.fromarray(np.round(255.0 * (grey / scale).clip(0.0, 1.0)).astype(np.uint8), "L")
    return _reduce(turned.convert("RGBA"))


def _reduce(picture: Image.Image) -> np.ndarray:
    """Float values; a picture with a side above WORKING is reduced (Pillow weights colours by alpha)."""
    share = WORKING / max(picture.size)
    if share < 1.0:
        width, height = (max(1, math.floor(side * share)) for side in picture.size)
        picture = picture.resize((width, height), Image.Resampling.BOX, reducing_gap=None)
    return np.asarray(picture, np.float32) / 255.0
