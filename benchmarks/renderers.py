"""`python -m benchmarks.renderers MESH...`: how near captures come to one by very many rays: the built-in one, and Blender's.

Each reads the file by itself. Inner pixels are those that are wholly covered in both, and so are their neighbours.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.csv_rows import write_rows
from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.renderers.base import AbstractRenderer
from charnerf.capture.renderers.blender import Blender
from charnerf.capture.renderers.built_in import BuiltIn
from charnerf.capture.studio import SUBSAMPLES
from charnerf.data.characters import CharacterPictures

VIEWS, SIZE = 2, 128
MANY = 1024  # rays a pixel: fewer leave noise along edges of colours, of either renderer
NEAR = 2  # of 255
COLUMNS = (
    "character",
    "capture",
    "cameras differ by",
    "silhouette pixels off",
    "depth differs by mm",
    "inner pixels",
    "of these within 2 of 255, %",
    "largest difference, of 255",
)
_AROUND = np.ones((3, 3), bool)


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.renderers", description=__doc__)
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/renderers.csv"))
    given = parser.parse_args(arguments)
    write_rows(given.output, _rows(given.meshes))


def _rows(meshes: Sequence[Path]) -> Iterator[dict[str, object]]:
    captures: dict[str, AbstractRenderer] = {
        f"built-in, {SUBSAMPLES} rays": BuiltIn(),
        f"Cycles, {Blender.samples}": Blender(),
        f"Cycles, {MANY}": Blender(samples=MANY),
    }
    for file in meshes:
        reference = pictures_of(file, BuiltIn(subsamples=MANY, edge_subsamples=MANY))
        for name, renderer in captures.items():
            cells = (file.stem, name, *differences(reference, pictures_of(file, renderer)))
            yield dict(zip(COLUMNS, cells, strict=True))


def pictures_of(file: Path, renderer: AbstractRenderer) -> CharacterPictures:
    """A capture of a file."""
    surface = renderer.read(file, None, None).surface
    options = CaptureOptions(views=VIEWS, size=SIZE, depth=True, renderer=renderer)
    return capture_character(surface, options).pictures


def differences(first: CharacterPictures, second: CharacterPictures) -> tuple[str, int, int, int, str, int]:
    """How two captures of a character differ.

    Returns:
        Largest difference of a number of a camera; pixels of one silhouette that are farther than a pixel from the
        other; depth, mm, of 99 of 100 pixels; inner pixels, the
        share of them that are near, in percent, and the largest difference of one.
    """
    poses = [each.cameras.world_from_camera.numpy() for each in (first, second)]
    off, inner = 0, []
    for one, other in zip(_all(first), _all(second), strict=True):
        masks = one[..., 3] > 127, other[..., 3] > 127
        off += sum(
            int((mask & ~ndimage.binary_dilation(near, _AROUND)).sum()) for mask, near in (masks, masks[::-1])
        )
        covered = ndimage.binary_erosion((one[..., 3] == 255) & (other[..., 3] == 255), _AROUND)
        inner.append(np.abs(one - other)[covered, :3].max(axis=-1))
    assert first.depths is not None and second.depths is not None
    depths = np.stack((first.depths, second.depths)).astype(np.int64)
    depth = np.percentile(np.abs(depths[0] - depths[1])[(depths > 0).all(axis=0)], 99)
    apart = np.concatenate(inner)
    near = 100.0 * float((apart <= NEAR).mean())
    cameras = f"{np.abs(poses[0] - poses[1]).max():.0e}"
    return cameras, off, int(depth), len(apart), f"{near:.2f}", int(apart.max())


def _all(pictures: CharacterPictures) -> np.ndarray:
    return np.concatenate((pictures.images, pictures.source_images)).astype(np.int64)


if __name__ == "__main__":
    main(sys.argv[1:])
