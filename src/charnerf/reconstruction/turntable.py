"""Pictures from around a character, and a film of them."""

from collections.abc import Callable, Sequence
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from PIL import Image

from charnerf.errors import DataError
from charnerf.inference.hero import Hero

ELEVATION_DEG = 10.0
SECONDS_A_TURN = 3.0


def render_around(
    hero: Hero, frames: int, size: int, *, on_frame: Callable[[], object] = lambda: None
) -> list[np.ndarray]:
    """Render pictures evenly around a character, from its front on.

    Args:
        hero: The character.
        frames: How many, at least 1.
        size: Their side, pixels.
        on_frame: Called after each, for a progress bar.

    Returns:
        RGBA uint8, (size, size, 4) each, straight alpha.

    Raises:
        DataError: If frames is below 1.
    """
    if frames < 1:
        raise DataError(f"frames: found {frames}, expected at least 1.")
    pictures = []
    for index in range(frames):
        picture = hero.render(azimuth_deg=360.0 * index / frames, elevation_deg=ELEVATION_DEG, size=size)
        pictures.append(np.rint(255.0 * picture).astype(np.uint8))
        on_frame()
    return pictures


def write_film(frames: Sequence[np.ndarray], folder: Path) -> tuple[Path, str | None]:
    """Write turntable.mp4, or turntable.gif where no ffmpeg is to be had.

    Args:
        frames: RGB uint8, (size, size, 3) each.
        folder: Folder to write into.

    Returns:
        The file, and why it is a GIF (None for MP4).
    """
    fps = max(1.0, len(frames) / SECONDS_A_TURN)
    path = folder / "turntable.mp4"
    # H.264 with 4:2:0 colours wants even sides
    even = [np.pad(f, ((0, f.shape[0] % 2), (0, f.shape[1] % 2), (0, 0)), mode="edge") for f in frames]
    try:
        iio.imwrite(
            path, np.stack(even), plugin="FFMPEG", fps=fps, codec="libx264", quality=8, macro_block_size=2
        )
    except (ImportError, OSError, RuntimeError, ValueError) as err:
        path.unlink(missing_ok=True)
        path = folder / "turntable.gif"
        images = [Image.fromarray(frame) for frame in frames]
        images[0].save(path, save_all=True, append_images=images[1:], duration=round(1000 / fps), loop=0)
        return path, f"a GIF, because no MP4 could be written ({' '.join(str(err).split())[:120]})"
    return path, None
