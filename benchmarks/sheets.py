"""`python -m benchmarks.sheets DATA`: how many composed sheets are split, named and aligned right, flagged, or silently wrong.

Front, side and back of captured characters, drawn at levels 0 to 2, in any order and spacing on papers of any colour, with text and
swatches, as a JPEG of quality 60; the side looks left or right, and one figure may be 8 % too small.
"""

from __future__ import annotations

import argparse
import csv
import io
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.drawings.artist import draw_character
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import drawing_from_array
from charnerf.drawings.read_sheet import read_sheet
from charnerf.drawings.sheet import find_figures
from charnerf.errors import DataError
from charnerf.pictures import to_bytes

PAPERS = ((255, 255, 255), (250, 247, 238), (214, 220, 228), (236, 224, 200), (120, 124, 130))
SIDE = 384  # pixels of the drawings, so that a sheet is not reduced as it is read
LEVELS = 3
SMALLER = 0.92  # of the others' size that one figure may have
NEAR = 6  # pixels by which a box may be off: ink and JPEG noise blur it


@dataclass(frozen=True)
class Composed:
    """A sheet and what is on it: names and boxes from the left, and whether one figure is too small."""

    page: np.ndarray
    names: tuple[str, ...]
    boxes: tuple[tuple[int, int, int, int], ...]
    is_uneven: bool


def compose(character: Character, *, level: int, seed: int) -> Composed:
    """One sheet of a character."""
    rng = np.random.default_rng(seed)
    figures = {}
    for view, drawn in draw_character(character, size=SIDE, seed=seed, level=level).items():
        figure = Image.fromarray(to_bytes(cut_out(drawing_from_array(drawn, view)).rgba))
        figures[view] = figure.crop(figure.getchannel("A").point(lambda alpha: 255 * (alpha > 127)).getbbox())
    if rng.random() < 0.5:
        figures["right"] = figures.pop("side").transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    names = tuple(rng.permutation(sorted(figures)).tolist())
    is_uneven = bool(rng.random() < 0.25)
    small = rng.choice(names) if is_uneven else None
    gaps = rng.integers(30, 90, len(names) + 1)
    tallest = max(one.height for one in figures.values())
    width = sum(one.width for one in figures.values()) + int(gaps.sum())
    page = Image.new("RGB", (width, tallest + 200), PAPERS[rng.integers(len(PAPERS))])
    left, boxes = int(gaps[0]), []
    for name, gap in zip(names, gaps[1:], strict=True):
        figure = figures[name]
        if name == small:
            figure = figure.resize((round(SMALLER * figure.width), round(SMALLER * figure.height)))
        top = 100 + tallest - figure.height
        page.paste(figure, (left, top), figure)
        boxes.append((left, top, left + figure.width, top + figure.height))
        left += figure.width + int(gap)
    _beside(page, rng)
    coded = io.BytesIO()
    page.save(coded, "JPEG", quality=60)
    return Composed(np.asarray(Image.open(coded)), names, tuple(boxes), is_uneven)


def verdict(sheet: Composed) -> str:
    """Whether the sheet is read right, refused, flagged, or wrong without a word."""
    wanted = ["left" if name == "side" else name for name in sheet.names]
    try:
        read = read_sheet(sheet.page)
        found = find_figures(drawing_from_array(sheet.page, "sheet")).figures
    except DataError:
        return "refused"
    named = read.assumptions[0].split(": ")[-1].rstrip(".").split(", ")
    is_right = [one.split(" ", 1)[-1] for one in named] == wanted
    is_split = len(found) == len(sheet.boxes) and all(
        np.abs(np.subtract(one.box, box)).max() <= NEAR for one, box in zip(found, sheet.boxes, strict=True)
    )
    if is_right and is_split:
        return "right"
    return "flagged" if read.warnings else "wrong"


def _beside(page: Image.Image, rng: np.random.Generator) -> None:
    """A title above and swatches below."""
    draw = ImageDraw.Draw(page)
    draw.text((20, 20), "Turnaround, final", fill=(60, 60, 60), font=ImageFont.load_default(size=30))
    for number, color in enumerate(rng.integers(0, 255, (5, 3)).tolist()):
        left, top = 20 + 50 * number, page.height - 60
        draw.rectangle((left, top, left + 36, top + 36), fill=tuple(color))


def main() -> None:
    """Read as many sheets as the command line says, and write a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="data set of captured characters")
    parser.add_argument("--split", required=True)
    parser.add_argument("--count", type=int, default=40, help="sheets")
    parser.add_argument("--seed", type=int, default=0, help="of the first sheet")
    parser.add_argument("-o", "--output", type=Path, required=True, help="CSV file")
    options = parser.parse_args()
    names = names_of(read_dataset(options.data), options.split)
    counts = {level: dict.fromkeys(("right", "flagged", "refused", "wrong"), 0) for level in range(LEVELS)}
    for seed in range(options.seed, options.seed + options.count):
        name, level = names[seed % len(names)], seed // len(names) % LEVELS
        sheet = compose(load_character(options.data, name), level=level, seed=seed)
        result = verdict(sheet)
        counts[level][result] += 1
        if result != "right":
            uneven = ", one figure too small" if sheet.is_uneven else ""
            sys.stderr.write(
                f"seed {seed}: {name} at level {level} ({', '.join(sheet.names)}{uneven}): {result}\n"
            )
    with options.output.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["level", *counts[0]], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"level": level, **row} for level, row in counts.items())


if __name__ == "__main__":
    main()
