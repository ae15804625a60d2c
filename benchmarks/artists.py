"""`python -m benchmarks.artists FOLDER...`: turnarounds by artists, of which no truth is known, reconstructed and measured.

A folder holds pictures named front, side, back, or by their azimuth in degrees. The three are given where they are there; without a
side, a three-quarter view of the front instead. What is not given is compared with what the model shows from there.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from benchmarks.csv_rows import write_rows
from charnerf.drawings.align import figure_box, place
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import load_drawing
from charnerf.drawings.viewpoints import Viewpoint, viewpoint
from charnerf.evaluation.metrics import haze, psnr, silhouette_iou
from charnerf.geometry.cameras import direction_from_angles
from charnerf.geometry.framing import framing_cameras
from charnerf.inference import weights
from charnerf.inference.hero import Hero
from charnerf.inference.model import Model
from charnerf.meshing.lod import num_parts
from charnerf.meshing.options import MeshOptions
from charnerf.meshing.sheet import ELEVATION_DEG, PANEL, contact_sheet
from charnerf.pictures import on_white, save_png, to_bytes
from charnerf.surfaces.render import render_clay
from charnerf.types import RenderOutput

TURNTABLE = range(20, 360, 45)  # azimuths, degrees
SQUARE = ("front", "side", "back")


def given_views(folder: Path, *, side_is: str) -> dict[Viewpoint, Path]:
    """What the model is given of a folder, the front first."""
    files = {one.stem: one for one in sorted(folder.glob("*.png"))}
    square = [name for name in SQUARE if name in files]
    if "side" not in square:
        square[1:1] = [name for name in ("045", "315") if name in files][:1]
    return {viewpoint(side_is if name == "side" else name): files[name] for name in square}


def measured(model: Model, folder: Path, *, side_is: str) -> tuple[dict[str, object], Image.Image]:
    """Figures of one turnaround, and a picture: the drawings, the mesh in colours and as clay, what the model shows."""
    views, start = given_views(folder, side_is=side_is), time.perf_counter()
    hero = model.encode_drawings(views)
    built = hero.build_mesh(MeshOptions(height=None))
    seconds = time.perf_counter() - start
    assert hero.turnaround is not None  # of drawings there is one
    masks = dict(zip(hero.turnaround.names, hero.turnaround.views.images[0, :, 3], strict=True))
    fit = {
        "side" if view.name in ("left", "right") else view.name: _iou(_seen(hero, view), masks[view.name])
        for view in views
        if view.name in masks  # where a side is guessed it stands for the view that it was guessed from
    }
    outlines = torch.from_numpy(render_clay(built.surface, hero.turnaround.views.cameras[0])[..., 3])
    turntable = [hero.render(azimuth_deg=a, elevation_deg=ELEVATION_DEG, size=PANEL) for a in TURNTABLE]
    hazes = [haze(torch.from_numpy(one[..., 3])) for one in turntable]
    decibels, overlaps = _others(hero, folder, views)
    row = {
        "drawing": folder.name,
        "views given": len(views),
        **{f"IoU {name}": _text([fit[name]] if name in fit else [], 3) for name in SQUARE},
        "others IoU": _text(overlaps, 2),
        "others dB": _text(decibels, 1),
        "haze": _text([one for one in hazes if one is not None], 3),
        "mesh: least IoU": f"{min(map(silhouette_iou, outlines, masks.values())):.3f}",
        "parts": num_parts(built.surface),
        "left out": built.num_floaters,
        "seconds": f"{seconds:.1f}",
    }
    shown = to_bytes(np.concatenate([on_white(one) for one in turntable], axis=1))
    sheet = np.asarray(contact_sheet(built.mesh, hero.turnaround.detailed))  # as wide as the turntable
    return row, Image.fromarray(np.concatenate((sheet, shown)))


def _seen(hero: Hero, view: Viewpoint) -> RenderOutput:
    """What the model shows of a character from where a drawing is seen from, on the drawings' canvas."""
    assert hero.turnaround is not None
    angles = torch.tensor((view.azimuth_deg, view.elevation_deg), dtype=torch.float64)
    size = hero.turnaround.views.images.shape[-1]
    direction = direction_from_angles(angles[0], angles[1])
    camera = framing_cameras(direction, radius=hero.turnaround.half_extent, size=size, orthographic=True)
    with torch.no_grad():
        return hero.renderer.render_camera(hero.scene, camera.to(torch.float32)).finest


def _others(hero: Hero, folder: Path, given: Mapping[Viewpoint, Path]) -> tuple[list[float], list[float]]:
    """PSNR and IoU with each drawing, named by its azimuth, that the model did not look at."""
    assert hero.turnaround is not None
    size, decibels, overlaps = hero.turnaround.views.images.shape[-1], [], []
    for file in sorted(folder.glob("[0-9]*.png")):
        view = viewpoint(int(file.stem))
        if view in given and view.name in hero.turnaround.names:
            continue
        cut = cut_out(load_drawing(file)).rgba
        box = figure_box(cut[..., 3], str(file))
        drawn = torch.from_numpy(place(cut, box, extent=hero.turnaround.half_extent, size=size))
        seen = _seen(hero, view)
        decibels.append(psnr(seen.rgb.clamp(0.0, 1.0), on_white(drawn)))
        overlaps.append(_iou(seen, drawn[..., 3]))
    return decibels, overlaps


def _iou(seen: RenderOutput, mask: Tensor) -> float:
    return silhouette_iou(seen.opacity.clamp(0.0, 1.0), mask)


def _text(values: Sequence[float], decimals: int) -> str:
    """Their mean; a dash where there are none."""
    return f"{fmean(values):.{decimals}f}" if values else "-"


def main() -> None:
    """Measure what the command line names; every row is written as soon as it is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="one a figure")
    parser.add_argument(
        "--right", action="append", default=[], help="folder's name whose side looks to the right"
    )
    parser.add_argument("--pictures", type=Path, help="folder for a picture of each")
    parser.add_argument("-o", "--output", type=Path, required=True, help="CSV file")
    options = parser.parse_args()
    write_rows(options.output, _rows(weights.load(None), options.folders, options.right, options.pictures))


def _rows(
    model: Model, folders: Sequence[Path], right: Sequence[str], pictures: Path | None
) -> Iterator[Mapping[str, object]]:
    for folder in folders:
        row, picture = measured(model, folder, side_is="right" if folder.name in right else "left")
        if pictures is not None:
            save_png(pictures / f"{folder.name}.png", picture)
        yield row


if __name__ == "__main__":
    main()
