"""`python -m benchmarks.mistakes DATA`: what each of the things by which drawings of a level differ from captures costs alone.

Front, side and back of captured characters on paper, with one of them at a time: tones and saturation, ink, an unsteady hand,
place and size, poses; with all of them; and where poses differ without reconciling too.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import torch

from benchmarks.csv_rows import write_rows
from charnerf.data.characters import Character
from charnerf.data.drawing_style import EXACT, random_style
from charnerf.drawings.artist import LEVELS, Mistakes, captured, in_style
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.redrawn import SIDE
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround
from charnerf.evaluation.evaluate import evaluate
from charnerf.geometry.framing import SOURCE_AZIMUTHS
from charnerf.inference import weights
from charnerf.meshing.build import find_surface
from charnerf.meshing.options import MeshOptions
from charnerf.surfaces.mesh_files import load_surface_mesh

PARTS = {  # fields of the style that are as the level has them; poses are no matter of style
    "paper alone": (),
    "tones and saturation": ("tones", "saturation"),
    "ink": ("ink", "inner_ink", "ink_rgb", "line_pixels"),
    "unsteady hand": ("wobble",),
    "place and size": ("shift", "scale"),
    "poses": (),
    "all of them": tuple(EXACT.__dataclass_fields__),
}
POSED = ("poses", "all of them")  # measured as drawn too
FIGURES = {
    "psnr": "PSNR dB",
    "psnr_union": "union dB",
    "silhouette_iou": "IoU",
    "haze": "haze",
    "chamfer_mm": "Chamfer mm",
}
# themselves, from where they were drawn
OF_DRAWINGS = {"psnr": "drawings dB", "silhouette_iou": "drawings IoU"}
DECIMALS = {"silhouette_iou": 3, "haze": 3, "chamfer_mm": 1}


def drawn_with(part: str, character: Character, *, level: int, size: int, reconciled: bool) -> Character:
    """A character whose source views are drawn with one part of a level's mistakes, and read."""
    mistakes, rng = LEVELS[level], np.random.default_rng(0)
    assert character.mesh_file is not None  # captured characters have one
    pose = mistakes if part in POSED else Mistakes(0.0, 0.0, 0.0)
    surface, azimuths = load_surface_mesh(character.mesh_file), tuple(SOURCE_AZIMUTHS.values())
    images = captured(surface, azimuths, size=SIDE, mistakes=pose, rng=rng)
    generator = torch.Generator().manual_seed(sum(character.name.encode()))
    whole = random_style(generator, wobble=mistakes.wobble, shift=mistakes.shift, scale=mistakes.scale)
    style = replace(EXACT, **{field: getattr(whole, field) for field in PARTS[part]})
    front, side, back = in_style(images, style, generator)
    options = ReadingOptions(reconciled=reconciled)
    read = read_views(turnaround(front, side, back), size=size, options=options)
    return replace(character, sources=read.views)


def _texts(found: Mapping[str, float], titles: Mapping[str, str]) -> dict[str, str]:
    return {title: f"{found[key]:.{DECIMALS.get(key, 2)}f}" for key, title in titles.items()}


def main() -> None:
    """Measure what the command line names; every row is written as soon as it is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="data set of captured characters, with their meshes")
    parser.add_argument("--split", required=True)
    parser.add_argument("--level", type=int, default=2, help="of the drawings")
    parser.add_argument("--views", type=int, default=4, help="measured of each character")
    parser.add_argument("--part", action="append", choices=PARTS, help="only this one; may be repeated")
    parser.add_argument("-o", "--output", type=Path, required=True, help="CSV file")
    options = parser.parse_args()
    write_rows(options.output, _rows(options))


def _rows(options: argparse.Namespace) -> Iterator[dict[str, str]]:
    """Every part, with reconciled views and, where they differ in pose, without."""
    model = weights.load(None)
    mesh = partial(find_surface, options=MeshOptions(height=None))
    for part in options.part or PARTS:
        for reconciled in (True, False) if part in POSED else (True,):
            redrawn = partial(
                drawn_with, part, level=options.level, size=model.image_size, reconciled=reconciled
            )
            found = evaluate(
                model.network,
                model.renderer,
                options.data,
                options.split,
                views=options.views,
                mesh=mesh,
                baselines=False,
                redrawn=redrawn,
            )
            figures = _texts(found["drawings"], OF_DRAWINGS) | _texts(found, FIGURES)
            yield {"drawn with": part, "reconciled": "yes" if reconciled else "no", **figures}


if __name__ == "__main__":
    main()
