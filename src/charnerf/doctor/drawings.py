"""Drawings examined: files first, then what the reader of drawings makes of them."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from charnerf.doctor.figure import CROPPED
from charnerf.doctor.finding import Finding
from charnerf.doctor.repairs import mirror_command
from charnerf.drawings.align import figure_box, on_one_scale
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.doubts import DoubtKind
from charnerf.drawings.load import load_drawing
from charnerf.drawings.naming import looks_left
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import AZIMUTHS, Viewpoint
from charnerf.errors import DataError
from charnerf.pictures import on_white, to_bytes

SIZE = 128  # pixels at which views are compared
SCALES = 1.1  # of the tallest figure over the shortest, in pictures of one size
NAMES = ("front", "side", "back", *AZIMUTHS)
FAULTS = {DoubtKind.MIRRORED: "mirrored picture", DoubtKind.COPIED: "duplicated view"}
SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")


def drawings_in(folder: Path) -> dict[str, Path]:
    """Drawings of a folder by the views that they are named after."""
    files = sorted(
        file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES and file.stem.lower() in NAMES
    )
    return {file.stem.lower(): file for file in files}


def drawing_findings(given: Mapping[Viewpoint, Path]) -> Iterator[Finding]:
    """What is wrong with drawings by where they are seen from."""
    whole: dict[Viewpoint, tuple[Path, np.ndarray]] = {}
    heights: dict[Path, tuple[float, tuple[int, int]]] = {}
    for view, file in given.items():
        try:
            drawing = load_drawing(file)
        except DataError as error:
            yield Finding(
                "unusable picture", str(file), str(error), "a picture that reconstruct reads", "Export it again, as it says."
            )  # fmt: skip
            continue
        try:
            cutout = cut_out(drawing)
            box = figure_box(cutout.rgba[..., 3], str(file))
        except DataError as error:
            yield Finding(
                "background that is not plain",
                str(file),
                str(error),
                "a figure on alpha or one plain colour",
                "Cut the figure out.",
            )
            continue
        whole[view] = file, cutout.rgba
        heights[file] = (box.height, drawing.size)
        alpha = cutout.rgba[..., 3] > 0.5
        border = np.concatenate((alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]))
        if int(border.sum()) >= CROPPED:
            yield Finding(
                "cropped figure", str(file), f"{int(border.sum())} pixels of the figure on the picture's border",
                "all of it, and room around", "Export the picture uncropped.", picture=to_bytes(on_white(cutout.rgba)),
            )  # fmt: skip
    yield from _scales(heights)
    yield from _sides(whole)
    yield from _together({view: file for view, (file, _) in whole.items()})


def _scales(heights: Mapping[Path, tuple[float, tuple[int, int]]]) -> Iterator[Finding]:
    """Figures of other heights in pictures of one size; they are read as one height all the same."""
    if len({size for _, size in heights.values()}) != 1 or len(heights) < 2:
        return
    tallest, shortest = (pick(heights, key=lambda file: heights[file][0]) for pick in (max, min))
    ratio = heights[tallest][0] / heights[shortest][0]
    if ratio > SCALES:
        yield Finding(
            "different scale", str(shortest),
            f"a figure {1.0 / ratio:.2f} times as tall as {tallest.name}'s, in pictures of one size", "1.00 times",
            f"Scale it by {ratio:.3f}; readers take all heights as one, so that a crouch is stretched.", is_broken=False,
        )  # fmt: skip


def _sides(whole: Mapping[Viewpoint, tuple[Path, np.ndarray]]) -> Iterator[Finding]:
    """Profiles that look to the other side than their name says by feet and face; with front and back, colours tell better."""
    if {"front", "back"} <= {view.name for view in whole}:
        return
    for view, (file, rgba) in whole.items():
        if view.name not in ("left", "right"):
            continue
        if looks_left(on_one_scale([rgba], [str(file)], SIZE)[0]) != (view.name == "left"):
            other = "right" if view.name == "left" else "left"
            yield Finding(
                "mirrored picture", str(file), f"a figure that looks to the picture's {other} by its feet and its face",
                f"the character's {view.name} side, which looks to the {view.name}", f"Say --side {other}, or flip the picture.",
                mirror_command(file), to_bytes(on_white(rgba)),
            )  # fmt: skip


def _together(whole: Mapping[Viewpoint, Path]) -> Iterator[Finding]:
    """What the reader of drawings warns of."""
    if len(whole) < 2:
        return
    try:
        read = read_views(whole, size=SIZE)
    except DataError as error:
        yield Finding(
            "drawings that do not fit",
            ", ".join(map(str, whole.values())),
            str(error),
            "views of one character",
            "",
        )
        return
    for doubt in read.doubts:
        fault = FAULTS.get(doubt.kind)
        command = mirror_command(Path(doubt.about)) if doubt.kind is DoubtKind.MIRRORED else ""
        yield Finding(
            fault or "drawings that disagree", doubt.about, doubt.sentence, "views that agree", "Mend the drawing.", command,
            picture=read.picture, is_broken=fault is not None,
        )  # fmt: skip
