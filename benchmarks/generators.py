"""`python -m benchmarks.generators ASSETS`: what generated characters cost, and a picture of some.

Seconds are those of the processor, one thread: they hold on a busy machine too. The generators take turns.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from benchmarks.csv_rows import write_rows
from charnerf.capture.character import CaptureOptions, capture_sources
from charnerf.capture.dataset import capture_scene_to
from charnerf.capture.generated import EMBEDDED, Generator, character_seed
from charnerf.capture.people_data import people_generator
from charnerf.capture.shapes_data import shapes_generator
from charnerf.pictures import bytes_on_white
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import SurfaceMesh

TURNS, VIEWS, SIZE = 8, 48, 128
SHOWN, COLUMNS, TILE, AZIMUTHS_DEG = 24, 8, 96, (0.0, 55.0)


def main(arguments: Sequence[str]) -> None:
    """Measure, write the table, and draw shapes and people."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.generators", description=__doc__)
    parser.add_argument("assets", type=Path, help="of people, see docs/generators.md")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    shapes, people = shapes_generator(), people_generator(options.assets)
    measured = rows({"embedded characters": EMBEDDED, "shapes": shapes, "people": people})
    write_rows(options.output / "generators.csv", measured)
    picture = np.concatenate([sheet(generator) for generator in (shapes, people)])
    Image.fromarray(picture).save(options.output / "generators.jpg", quality=80, optimize=True)


def rows(generators: dict[str, Generator]) -> list[dict[str, str]]:
    """Medians of the seconds of a character, and of its triangles."""
    measured: dict[str, list[tuple[float, float, int]]] = {name: [] for name in generators}
    with tempfile.TemporaryDirectory() as folder:
        for index in range(TURNS + 1):
            for name, generator in generators.items():
                begun = time.process_time()
                surface = _surface(generator, index)
                made = time.process_time()
                capture_scene_to(
                    Path(folder), f"{generator.name}-{index}", surface, CaptureOptions(VIEWS, SIZE)
                )
                measured[name].append((made - begun, time.process_time() - made, len(surface.triangles)))
    table = []
    for name, turns in measured.items():
        make, capture, triangles = (
            statistics.median(column) for column in zip(*turns[1:], strict=True)
        )  # the first reads files
        table.append(
            {
                "generator": name,
                "to make, s": f"{make:.2f}",
                "to capture and write, s": f"{capture:.2f}",
                "characters a minute": f"{60.0 / (make + capture):.0f}",
                "triangles": f"{triangles:.0f}",
            }
        )
    return table


def sheet(generator: Generator) -> np.ndarray:
    """The first characters of a generator, each from the front and between front and side, uint8 (h, w, 3)."""
    tiles = []
    for index in range(SHOWN):
        views = capture_sources(_surface(generator, index), TILE, AZIMUTHS_DEG)
        tiles.append(np.concatenate([bytes_on_white(view) for view in views], axis=1))
    lines = [np.concatenate(tiles[first : first + COLUMNS], axis=1) for first in range(0, SHOWN, COLUMNS)]
    return np.concatenate(lines)


def _surface(generator: Generator, index: int) -> SurfaceMesh:
    made = generator.make(character_seed(0, "test", index))
    return made if isinstance(made, SurfaceMesh) else surface_of_scene(made)


if __name__ == "__main__":
    main(sys.argv[1:])
