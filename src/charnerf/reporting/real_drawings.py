"""Real drawings through every row: no truth, so pictures alone.

A folder of drawings holds a folder for each character, with pictures whose names contain `front`, `side`, `back`, or loose
pictures, each a front view. `NAME_mask.png` beside `NAME.png` or `NAME_texture.png` is its alpha.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from charnerf.drawings.align import figure_box, half_extent, place
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import drawing_from_array, load_drawing
from charnerf.drawings.missing_side import guessed_side
from charnerf.errors import CharNeRFError, DataError
from charnerf.geometry.framing import SOURCE_ORDER, source_cameras
from charnerf.inference.model import Model
from charnerf.inference.weights import load
from charnerf.pictures import open_picture
from charnerf.reporting.blocks import Block, Heading, Picture, Text
from charnerf.reporting.picture_sheet import CELL, picture_on_white, save_sheet
from charnerf.reporting.rows import Row
from charnerf.types import SourceViews

SHOWN = (30.0, 150.0)  # azimuths rendered
PICTURES = (".png", ".jpg", ".jpeg", ".webp")
_MASK, _TEXTURE = "_mask", "_texture"


@dataclass(frozen=True)
class DrawnCharacter:
    """A character in drawings: its name and the files of those views that there are."""

    name: str
    files: Mapping[str, Path]


def find_drawings(folder: Path) -> list[DrawnCharacter]:
    """Characters in a folder of drawings, by name.

    Raises:
        DataError: If there is none, or a folder holds two pictures of one view.
    """
    characters = [
        DrawnCharacter(path.stem.removesuffix(_TEXTURE), {"front": path}) for path in _pictures(folder)
    ]
    for sub in sorted(path for path in folder.iterdir() if path.is_dir()):
        files: dict[str, Path] = {}
        others = []
        for path in _pictures(sub):
            views = [view for view in SOURCE_ORDER if view in re.split("[^a-z]+", path.stem.lower())]
            if len(views) != 1:
                others.append(path)
            elif views[0] in files:
                raise DataError(
                    f"{sub}: found {files[views[0]].name} and {path.name}, expected one {views[0]} view of a character."
                )
            else:
                files[views[0]] = path
        if "front" in files:
            characters.append(DrawnCharacter(sub.name, files))
        else:
            characters += [
                DrawnCharacter(path.stem.removesuffix(_TEXTURE), {"front": path}) for path in others
            ]
    if not characters:
        raise DataError(
            f"{folder}: found no drawings, expected CHARACTER/front.png (and side.png, back.png) or pictures of fronts."
        )
    return characters


def drawn_views(character: DrawnCharacter, size: int) -> tuple[SourceViews, str]:
    """Source views (B = 1) of what is drawn, and what was assumed about the rest.

    A back that is not drawn is taken to be the mirrored front, whose outline it has; a side that is not drawn is guessed from the
    front: without one, nothing would bound the depth.

    Raises:
        DataError: If a picture can not be read or shows no figure.
    """
    cut = {view: _cut_out(path) for view, path in character.files.items()}
    assumed = "" if len(cut) == len(SOURCE_ORDER) else f"drawn: {', '.join(cut)}"
    if "back" not in cut:
        cut["back"] = cut["front"][:, ::-1].copy()
    if "side" not in cut:
        cut["side"] = guessed_side({0.0: cut["front"]}, 90.0)
    boxes = [figure_box(cut[view][..., 3], f"{character.name}, {view}") for view in SOURCE_ORDER]
    extent = half_extent([(cut[view][..., 3], box) for view, box in zip(SOURCE_ORDER, boxes, strict=True)])
    canvases = [
        place(cut[view], box, extent=extent, size=size) for view, box in zip(SOURCE_ORDER, boxes, strict=True)
    ]
    flags = torch.zeros(1, len(SOURCE_ORDER), dtype=torch.bool)
    views = SourceViews(
        images=torch.from_numpy(np.stack(canvases)).permute(0, 3, 1, 2)[None].contiguous(),
        cameras=source_cameras(radius=extent, size=size).to(torch.float32)[None],
        present=~flags,
        mirrored=flags.clone(),
    )
    return views, assumed


def real_drawings(
    rows: Sequence[Row],
    drawings: Path,
    folder: Path,
    *,
    trusted: Sequence[str] = (),
    title: str = "",
    suffix: str = "",
) -> list[Block]:
    """The sheet of drawings through the first run of every row; rows whose weights are gone are named.

    The suffix is that of the picture's name.

    Raises:
        DataError: If the folder holds no drawings.
    """
    characters = find_drawings(drawings)
    blocks: list[Block] = [Heading(f"Real drawings in every row{title}")]
    models: dict[str, Model] = {}
    for row in rows:
        try:
            models[row.label] = load(row.runs[0].folder, trusted_targets=trusted)
        except CharNeRFError as error:
            blocks.append(Text(f"{row.label} can not be loaded: {error}"))
    if not models:
        return blocks
    lines, problems = [], []
    for character in characters:
        try:
            lines += _lines(character, models)
        except CharNeRFError as error:
            problems.append(f"{character.name} is left out: {error}")
    if lines:
        path = save_sheet(folder / f"report_drawings{suffix}.png", [*SOURCE_ORDER, *models], lines)
        blocks.append(Picture(path, "Drawings through every row, seen from azimuth 30 and 150 degrees"))
    note = (
        "No truth exists for these. A back that is not drawn is the mirrored front, a side that is not drawn a guess from the"
        " front's widths: both are shown as the models got them. Their licences are told where they lie, not here."
    )
    return [*blocks, Text(note), *(Text(problem) for problem in problems)]


def _lines(
    character: DrawnCharacter, models: Mapping[str, Model]
) -> list[tuple[str, list[Image.Image | None]]]:
    """One line for every azimuth; the drawings stand in the first."""
    by_size: dict[int, tuple[SourceViews, str]] = {}
    heroes = []
    for model in models.values():
        size = model.image_size
        if size not in by_size:
            by_size[size] = drawn_views(character, size)
        heroes.append(model.encode_views(by_size[size][0]))
    views, assumed = by_size[max(by_size)]
    shown: list[Image.Image | None] = [picture_on_white(image.permute(1, 2, 0)) for image in views.images[0]]
    lines: list[tuple[str, list[Image.Image | None]]] = []
    for azimuth in SHOWN:
        pictures = [
            picture_on_white(hero.render(azimuth_deg=azimuth, elevation_deg=10.0, size=CELL))
            for hero in heroes
        ]
        label = f"{character.name}\n{azimuth:.0f}°\n{'' if lines else assumed}"
        lines.append((label, [*([None] * len(shown) if lines else shown), *pictures]))
    return lines


def _pictures(folder: Path) -> list[Path]:
    """Pictures of a folder that are no masks, by name."""
    files = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in PICTURES]
    return [path for path in files if not path.stem.endswith(_MASK)]


def _cut_out(path: Path) -> np.ndarray:
    """The figure of a picture, floats (H, W, 4): by the mask beside it, by its own alpha or by its background."""
    mask = path.with_name(f"{path.stem.removesuffix(_TEXTURE)}{_MASK}.png")
    if not mask.is_file():
        return cut_out(load_drawing(path)).rgba
    with open_picture(path) as picture, open_picture(mask) as alpha:
        rgba = picture.convert("RGBA")
        rgba.putalpha(alpha.convert("L").resize(rgba.size))
    return cut_out(drawing_from_array(np.array(rgba), path.name)).rgba
