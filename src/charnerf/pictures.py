"""Pictures: on white, as bytes, read between pixels, and PNG files."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch
from PIL import Image, ImageFont, UnidentifiedImageError
from scipy import ndimage
from torch import Tensor

from charnerf.errors import DataError
from charnerf.files import open_regular, write_aside

FORMATS = ("PNG", "JPEG", "MPO", "WEBP", "GIF", "BMP", "TIFF", "JPEG2000", "AVIF", "TGA")
LARGEST = 200_000_000  # pixels; above, a picture is refused before it is decoded

Array = TypeVar("Array", Tensor, np.ndarray)


def on_white(rgba: Array) -> Array:
    """Straight-alpha pixels (..., 4) in [0, 1] on white, (..., 3)."""
    return rgba[..., :3] * rgba[..., 3:] + (1.0 - rgba[..., 3:])


def images_on_white(images: Tensor) -> Tensor:
    """The same with channels first: (..., 4, H, W) on white, (..., 3, H, W)."""
    alpha = images[..., 3:, :, :]
    return images[..., :3, :, :] * alpha + (1.0 - alpha)


def bytes_on_white(rgba: np.ndarray) -> np.ndarray:
    """Straight-alpha pixels (..., 4) uint8 on white, (..., 3) uint8."""
    return to_bytes(on_white(rgba / 255.0))


def to_bytes(values: Tensor | np.ndarray) -> np.ndarray:
    """Numbers in [0, 1] as bytes of the same shape; what lies outside is clamped."""
    return (torch.as_tensor(values).detach().clamp(0.0, 1.0) * 255.0).round().to(torch.uint8).cpu().numpy()


def read_bilinear(picture: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Values (K, C) of a picture (H, W, C) at positions (K, 2), x right and y down, between pixel centres; the edge's beyond it."""
    at = np.stack((pixels[:, 1], pixels[:, 0])) - 0.5
    channels = [
        ndimage.map_coordinates(channel, at, order=1, mode="nearest")
        for channel in np.moveaxis(picture, -1, 0)
    ]
    return np.stack(channels, axis=1)


def cut_text(text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: float) -> str:
    """Text that fits into a width, pixels, its middle left out where it is longer."""
    kept = len(text)
    shown = text
    while kept > 1 and font.getlength(shown) > width:
        kept -= 1
        shown = f"{text[: (kept + 1) // 2]}…{text[len(text) - kept // 2 :]}"
    return shown


@contextmanager
def open_picture(source: Path | bytes, name: str | None = None) -> Iterator[Image.Image]:
    """A picture, not yet decoded, of one of FORMATS, whatever its suffix says: others start programs, such as Ghostscript.

    Args:
        source: A file, or the content of one.
        name: What to call it in messages; the file's path if None.

    Raises:
        DataError: If it has too many pixels, or is no file.
        OSError: If it can not be opened, or is of another format (`UnidentifiedImageError`).
    """
    name = name or str(source)
    with io.BytesIO(source) if isinstance(source, bytes) else open_regular(source) as stream:
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None  # our own check, with the file's name
        try:
            picture = Image.open(stream, formats=readable_formats())
        except UnidentifiedImageError as error:  # which names the stream
            raise UnidentifiedImageError("of none of the formats that are read") from error
        finally:
            Image.MAX_IMAGE_PIXELS = limit
        with picture:
            check_pixels(name, picture.size)
            yield picture


def check_pixels(name: str, size: tuple[int, int]) -> None:
    """Check that a picture of some width and height is not too large to be decoded.

    Raises:
        DataError: If it is.
    """
    width, height = size
    if width * height > LARGEST:
        raise DataError(
            f"{name}: found {width} x {height} pixels, expected at most {LARGEST // 10**6} million. Reduce "
            "the picture."
        )


def readable_formats() -> list[str]:
    """Those of FORMATS that this Pillow was built with."""
    Image.init()
    return [one for one in FORMATS if one in Image.OPEN]


def save_png(path: Path, picture: Image.Image) -> None:
    """Write a PNG file, whole or not at all, with the folders that it needs."""
    with write_aside(path) as aside:
        picture.save(aside, format="PNG")
