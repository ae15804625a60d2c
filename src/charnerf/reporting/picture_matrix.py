"""The picture matrix: drawings, truth and every row, of the same characters and views."""

from collections.abc import Sequence
from pathlib import Path

import torch
from PIL import Image

from charnerf.data.characters import Character, load_character
from charnerf.errors import DataError
from charnerf.evaluation.angles import view_angles
from charnerf.reporting.blocks import Block, Heading, Picture, Text
from charnerf.reporting.characters import ranked
from charnerf.reporting.picture_sheet import open_on_white, picture_on_white, save_sheet
from charnerf.reporting.rows import Row
from charnerf.reporting.runs import Run, data_root

CHARACTERS = 4
AZIMUTHS = (45.0, 270.0)  # between two drawings, and the side that none shows
LEVEL_WEIGHT = 0.5  # of a degree of elevation against one of azimuth when a view is chosen


def picture_matrix(rows: Sequence[Row], folder: Path, *, title: str = "", suffix: str = "") -> list[Block]:
    """The sheet of test characters, evenly from the worst to the best, in two views each; the suffix is of the file's name."""
    runs = [row.runs[0] for row in rows]
    names = [name for name in ranked(rows) if all((run.folder / "images" / name).is_dir() for run in runs)]
    blocks: list[Block] = [Heading(f"The same characters and views in every row{title}")]
    if not names:
        return [*blocks, Text("The runs kept no predictions (images/) of one and the same character.")]
    last, count = len(names) - 1, min(CHARACTERS, len(names))
    chosen = list(dict.fromkeys(names[round(step * last / max(count - 1, 1))] for step in range(count)))
    try:
        root = data_root(runs[0])
        opened = [load_character(root, name) for name in chosen]
    except DataError as error:
        return [*blocks, Text(f"Drawings and truth can not be read: {error}")]
    views = max(len(character.source_names) for character in opened)
    columns = [*opened[0].source_names, *[""] * (views - len(opened[0].source_names)), "truth"]
    lines = [line for character in opened for line in _lines(character, runs, views)]
    path = save_sheet(folder / f"report_matrix{suffix}.png", [*columns, *(row.label for row in rows)], lines)
    caption = (
        "Drawings, truth and every row; characters from the worst to the best, the first seed of each row"
    )
    return [*blocks, Picture(path, caption)]


def _lines(
    character: Character, runs: Sequence[Run], views: int
) -> list[tuple[str, list[Image.Image | None]]]:
    """One line a view; the drawings stand in the first."""
    drawings: list[Image.Image | None] = [
        picture_on_white(image.movedim(0, -1)) for image in character.sources.images[0]
    ]
    drawings += [None] * (views - len(drawings))
    empty: list[Image.Image | None] = [None] * views
    angles = view_angles(character.cameras, character.sources)
    lines: list[tuple[str, list[Image.Image | None]]] = []
    for index in chosen_views(character, runs, angles.azimuth_deg, angles.elevation_deg):
        stem = character.image_files[index].stem
        angle = f"{float(angles.azimuth_deg[index]):.0f}°, up {float(angles.elevation_deg[index]):.0f}°"
        pictures = [open_on_white(run.folder / "images" / character.name / f"{stem}.png") for run in runs]
        truth = open_on_white(character.image_files[index])
        lines.append((f"{character.name}\n{angle}", [*(empty if lines else drawings), truth, *pictures]))
    return lines


def chosen_views(
    character: Character, runs: Sequence[Run], azimuth_deg: torch.Tensor, elevation_deg: torch.Tensor
) -> list[int]:
    """Frames nearest to AZIMUTHS that every run predicted, level ones preferred."""
    there = [
        index
        for index, file in enumerate(character.image_files)
        if all((run.folder / "images" / character.name / f"{file.stem}.png").is_file() for run in runs)
    ]
    chosen: list[int] = []
    for wanted in AZIMUTHS:
        free = [index for index in there if index not in chosen]
        if free:
            away = ((azimuth_deg[free] - wanted + 180.0) % 360.0 - 180.0).abs()
            chosen.append(free[int((away + LEVEL_WEIGHT * elevation_deg[free].abs()).argmin())])
    return chosen
