"""Make README.md's picture, those of docs/gallery.md and the examples of the page.

    python -m docs.pictures --meshes FOLDER --drawn FOLDER

FOLDER/NAME.glb and FOLDER/NAME/VIEW.png are the characters that docs/gallery/pictures.csv names; they stay where they are. Without
one of the options its picture is left as it is.
"""

import argparse
import csv
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

import charnerf
from charnerf.app.examples import write_examples
from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.lights import Unlit
from charnerf.cli import run
from charnerf.data.characters import load_character
from charnerf.inference.model import Model
from charnerf.pictures import bytes_on_white
from charnerf.procedural import make_character
from charnerf.types import SourceViews

FOLDER = Path(__file__).parent / "gallery"
AZIMUTHS_DEG, ELEVATION_DEG = (30, 60, 135, 225, 315), 15
SIDE, GAP, CAPTION = 128, 12, 16
COLORS = 128  # of a picture
INK = (60, 60, 60)

Drawings = Mapping[str, np.ndarray]
"""RGBA bytes (H, W, 4) by view."""


def main() -> None:
    """Make those pictures whose characters are there."""
    parser = argparse.ArgumentParser(prog="python -m docs.pictures", description=__doc__)
    parser.add_argument("--meshes", type=Path)
    parser.add_argument("--drawn", type=Path)
    options = parser.parse_args()
    with (FOLDER / "pictures.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    model = charnerf.load()
    places = {
        "embedded": Path(),
        "readme": options.meshes,
        "real": options.meshes,
        "drawn": options.drawn,
    }
    for kind, place in places.items():
        if place is not None:
            found = [drawings(place, row) for row in rows if row["picture"] == kind]
            made = FOLDER.parent / "gallery.png" if kind == "readme" else FOLDER / f"{kind}.png"
            sheet(model, found).quantize(COLORS).save(made, optimize=True)
    write_examples(Path(charnerf.__file__).parent / "app" / "examples")


def drawings(place: Path, row: Mapping[str, str]) -> Drawings:
    """The drawings of a character, in the order of its views."""
    views = row["views"].split()
    if row["picture"] == "drawn":
        opened = [Image.open(place / row["name"] / f"{view}.png").convert("RGBA") for view in views]
        names = ["left" if view == "side" else view for view in views]
        return dict(zip(names, map(np.asarray, opened), strict=True))
    if row["picture"] == "embedded":
        options = CaptureOptions(views=1, size=SIDE, light=Unlit())
        return _of(capture_character(make_character(int(row["name"])), options).pictures.source_views, views)
    with tempfile.TemporaryDirectory() as folder:
        mesh, dataset = place / f"{row['name']}.glb", Path(folder) / "captured"
        run(
            [
                "capture",
                str(mesh),
                "-o",
                str(dataset),
                "--split",
                "test",
                "--views",
                "1",
                "--size",
                str(SIDE),
                "--quiet",
            ]
        )
        return _of(load_character(dataset, row["name"]).sources, views)


def _of(sources: SourceViews, views: list[str]) -> Drawings:
    pictures = (255.0 * sources.images[0].movedim(1, -1)).round().byte().numpy()
    return dict(zip(views, pictures, strict=True))


def sheet(model: Model, rows: list[Drawings]) -> Image.Image:
    """A row each: the drawings, then views that nobody drew."""
    columns = max(map(len, rows))
    width = (columns + len(AZIMUTHS_DEG)) * SIDE + GAP
    picture = Image.new("RGB", (width, CAPTION + len(rows) * SIDE), "white")
    pen, font, right = ImageDraw.Draw(picture), ImageFont.load_default(12), columns * SIDE + GAP
    pen.text((4, 1), "drawings", INK, font)
    pen.text(
        (right + 4, 1),
        f"reconstructed: {', '.join(map(str, AZIMUTHS_DEG))} degrees, {ELEVATION_DEG} up",
        INK,
        font,
    )
    for place, row in enumerate(rows):
        hero = model.encode(views={view: drawing for view, drawing in row.items()})
        top = CAPTION + place * SIDE
        for column, drawing in enumerate(row.values()):
            shown = Image.fromarray(bytes_on_white(drawing))
            picture.paste(
                ImageOps.pad(shown, (SIDE, SIDE), Image.Resampling.LANCZOS, color="white"),
                (column * SIDE, top),
            )
        for column, azimuth in enumerate(AZIMUTHS_DEG):
            seen = hero.render(azimuth_deg=azimuth, elevation_deg=ELEVATION_DEG, size=SIDE)
            view = Image.fromarray(bytes_on_white(np.rint(255.0 * seen).astype(np.uint8)))
            picture.paste(view, (right + column * SIDE, top))
    return picture


if __name__ == "__main__":
    main()
