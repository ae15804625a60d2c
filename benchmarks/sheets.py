"""`python -m benchmarks.sheets DATA`: how many sheets are split, named and aligned right, asked about, refused, or silently wrong.

naming.csv: front, side and back of captured characters, drawn at levels 0 to 2, named in every order. pages.csv: whole pages
of them, in any order and spacing on papers of any colour, with text and swatches, as a JPEG of quality 60; the side looks left
or right, and one figure may be 8 % too small.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.csv_rows import write_rows
from charnerf.data.characters import Character, load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.drawings.align import on_one_scale
from charnerf.drawings.artist import draw_character
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import drawing_from_array
from charnerf.drawings.naming import name_views
from charnerf.drawings.read_sheet import CANVAS, SheetViews, read_sheet
from charnerf.errors import DataError
from charnerf.pictures import to_bytes
from charnerf.reconciling.agreement import share_apart

PAPERS = ((255, 255, 255), (250, 247, 238), (214, 220, 228), (236, 224, 200), (120, 124, 130))
SIDE = 384  # pixels of the drawings, so that a sheet is not reduced as it is read
LEVELS = 3
SMALLER = 0.92  # of the others' size that one figure may have
NEAR = 8  # pixels by which a box may be off: a block of the JPEG
MODEL_SIDE = 128  # pixels that the model sees of a figure
ALIGNED = 0.05  # share of them that may lie farther than one from the composed figure's
VERDICTS = ("right", "of them asked about", "wrong and asked about", "refused", "silently wrong")
Cut = Mapping[str, np.ndarray]  # RGBA (H, W, 4) by name of the view


@dataclass(frozen=True)
class Composed:
    """A JPEG's bytes and what is on it, from the left: names, boxes, and figures RGBA; and whether one figure is too small."""

    page: bytes
    names: tuple[str, ...]
    boxes: tuple[tuple[int, int, int, int], ...]
    figures: tuple[np.ndarray, ...]
    is_uneven: bool


def drawn(character: Character, *, level: int, seed: int) -> Cut:
    """Front, left and back of a character, drawn and cut out."""
    drawings = draw_character(character, size=SIDE, seed=seed, level=level)
    return {
        "left" if view == "side" else view: cut_out(drawing_from_array(picture, view)).rgba
        for view, picture in drawings.items()
    }


def naming(cuts: Sequence[Cut]) -> Iterator[dict[str, object]]:
    """How figures without a page are named, a row for each order that they stand in."""
    for order in permutations(("front", "left", "back")):
        counts: Counter[str] = Counter()
        for cut in cuts:
            named = name_views(on_one_scale([cut[view] for view in order], order, CANVAS))
            counts += _counted([one.name for one in named.viewpoints] == list(order), named.is_doubtful)
        title = ", ".join(order).replace("left", "side")
        yield {
            "order": title,
            "sheets": len(cuts),
            **{one: counts[one] for one in VERDICTS if one != "refused"},
        }


def compose(cut: Cut, *, seed: int) -> Composed:
    """One page of a character."""
    rng = np.random.default_rng(seed)
    figures = {}
    for view, rgba in cut.items():
        figure = Image.fromarray(to_bytes(rgba))
        figures[view] = figure.crop(figure.getchannel("A").point(lambda alpha: 255 * (alpha > 127)).getbbox())
    if rng.random() < 0.5:
        figures["right"] = figures.pop("left").transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    names = tuple(rng.permutation(sorted(figures)).tolist())
    is_uneven = bool(rng.random() < 0.25)
    if is_uneven:
        small = rng.choice(names)
        width, height = figures[small].size
        figures[small] = figures[small].resize((round(SMALLER * width), round(SMALLER * height)))
    gaps = rng.integers(30, 90, len(names) + 1)
    tallest = max(one.height for one in figures.values())
    across = sum(one.width for one in figures.values()) + int(gaps.sum())
    page = Image.new("RGB", (across, tallest + 200), PAPERS[rng.integers(len(PAPERS))])
    left, boxes = int(gaps[0]), []
    for name, gap in zip(names, gaps[1:], strict=True):
        figure = figures[name]
        top = 100 + tallest - figure.height
        page.paste(figure, (left, top), figure)
        boxes.append((left, top, left + figure.width, top + figure.height))
        left += figure.width + int(gap)
    _beside(page, rng)
    coded = io.BytesIO()
    page.save(coded, "JPEG", quality=60)
    whole = tuple(np.asarray(figures[name], np.float32) / 255.0 for name in names)
    return Composed(coded.getvalue(), names, tuple(boxes), whole, is_uneven)


def _beside(page: Image.Image, rng: np.random.Generator) -> None:
    """A title above and swatches below."""
    draw = ImageDraw.Draw(page)
    draw.text((20, 20), "Turnaround, final", fill=(60, 60, 60), font=ImageFont.load_default(size=30))
    for number, color in enumerate(rng.integers(0, 255, (5, 3)).tolist()):
        left, top = 20 + 50 * number, page.height - 60
        draw.rectangle((left, top, left + 36, top + 36), fill=tuple(color))


def read_right(sheet: Composed) -> Counter[str]:
    """Whether a page is read right, asked about, refused, or wrong without a word."""
    try:
        with NamedTemporaryFile(suffix=".jpg") as file:
            Path(file.name).write_bytes(sheet.page)
            return judged(read_sheet(file.name), sheet)
    except DataError:
        return Counter(("refused",))


def judged(read: SheetViews, sheet: Composed) -> Counter[str]:
    """Whether what was read is what was composed, and whether anything was asked."""
    is_right = _is_split(read, sheet) and _is_named(read, sheet) and _is_aligned(read, sheet)
    return _counted(is_right, bool(read.warnings))


def _is_split(read: SheetViews, sheet: Composed) -> bool:
    boxes = [one.box for one in read.sheet.figures]
    return len(boxes) == len(sheet.boxes) and bool(np.abs(np.subtract(boxes, sheet.boxes)).max() <= NEAR)


def _is_named(read: SheetViews, sheet: Composed) -> bool:
    return [view and view.name for view in read.views] == list(sheet.names)


def _is_aligned(read: SheetViews, sheet: Composed) -> bool:
    """Whether every figure lies on the common scale, floor line and axis where it lies without page and noise."""
    found = [cut_out(one.drawing).rgba for one in read.sheet.figures]
    canvases = on_one_scale([*found, *sheet.figures], sheet.names * 2, MODEL_SIDE)
    count = len(found)
    return all(
        share_apart(one[..., 3], other[..., 3]) <= ALIGNED
        for one, other in zip(canvases[:count], canvases[count:], strict=True)
    )


def _counted(is_right: bool, is_asked: bool) -> Counter[str]:
    if is_right:
        return Counter(VERDICTS[: 1 + is_asked])
    return Counter((VERDICTS[2] if is_asked else VERDICTS[-1],))


def pages(cuts: Sequence[tuple[str, int, Cut]], count: int, seed: int) -> Iterator[dict[str, object]]:
    """How pages are read, a row for each level; what is not read right is said."""
    by_level: dict[int, Counter[str]] = {level: Counter() for level in range(LEVELS)}
    for number in range(seed, seed + count):
        name, level, cut = cuts[number % len(cuts)]
        sheet = compose(cut, seed=number)
        found = read_right(sheet)
        by_level[level] += found
        by_level[level]["sheets"] += 1
        if not found["right"]:
            uneven = ", one figure too small" if sheet.is_uneven else ""
            order = ", ".join(sheet.names)
            sys.stderr.write(
                f"page {number}: {name} at level {level} ({order}{uneven}): {', '.join(found)}\n"
            )
    for level, counts in by_level.items():
        yield {"level": level, **{one: counts[one] for one in ("sheets", *VERDICTS)}}


def main() -> None:
    """Measure what the command line names and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="data set of captured characters")
    parser.add_argument("--split", action="append", required=True, help="as often as wanted")
    parser.add_argument(
        "--pages", type=int, default=20, help="how many; every character at every level in turn"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the first page")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of the tables")
    options = parser.parse_args()
    info = read_dataset(options.data)
    names = [name for split in options.split for name in names_of(info, split)]
    characters = [load_character(options.data, name) for name in names]
    cuts = [
        (one.name, level, drawn(one, level=level, seed=0))
        for shift in range(LEVELS)  # neighbours differ in character and level
        for level, one in (((number + shift) % LEVELS, one) for number, one in enumerate(characters))
    ]
    for table, rows in (
        ("naming", naming([cut for _, _, cut in cuts])),
        ("pages", pages(cuts, options.pages, options.seed)),
    ):
        write_rows(options.output / f"{table}.csv", rows)


if __name__ == "__main__":
    main()
