"""The page's examples: characters of the embedded generator, drawn; `write_examples` writes the pictures in `examples/`."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
from PIL import Image

SIZE = 512  # pixels a side


@dataclass(frozen=True)
class Example:
    """One example.

    Attributes:
        title: What the page calls it.
        seed: Of the character and of the hand that draws it.
        azimuths_deg: From where it is drawn, by the files' names.
        is_sheet: Whether all views are one picture, sheet.png.
    """

    title: str
    seed: int
    azimuths_deg: Mapping[str, float]
    is_sheet: bool = False


SQUARE = {"front": 0.0, "side": 90.0, "back": 180.0}
EXAMPLES = {
    "rabbit": Example("Rabbit: three drawings", 13, SQUARE),
    "ranger": Example("Ranger: one sheet", 9, SQUARE, is_sheet=True),
    "ogre": Example("Ogre: four drawings", 15, {"front": 0.0, "left": 90.0, "back": 180.0, "right": 270.0}),
}


def example_files(name: str) -> list[Path]:
    """The pictures of an example, in the order in which they are given."""
    example = EXAMPLES[name]
    folder = Path(str(files("charnerf.app").joinpath("examples", name)))
    return [folder / f"{view}.png" for view in (("sheet",) if example.is_sheet else example.azimuths_deg)]


def draw_example(example: Example) -> dict[str, np.ndarray]:
    """Its pictures, RGB uint8, by the files' names."""
    from charnerf.drawings.artist import LEVELS, captured, on_paper
    from charnerf.procedural import make_character
    from charnerf.surfaces.scene_mesh import surface_of_scene

    images = captured(
        surface_of_scene(make_character(example.seed)),
        tuple(example.azimuths_deg.values()),
        size=SIZE,
        mistakes=LEVELS[1],
        rng=np.random.default_rng(example.seed),
    )
    drawn = on_paper(images, LEVELS[1], seed=example.seed)
    if example.is_sheet:
        return {"sheet": np.concatenate(list(drawn), axis=1)}
    return dict(zip(example.azimuths_deg, drawn, strict=True))


def write_examples(folder: Path) -> None:
    """Write all of them, FOLDER/NAME/VIEW.png: what the package holds."""
    for name, example in EXAMPLES.items():
        (folder / name).mkdir(parents=True, exist_ok=True)
        for view, pixels in draw_example(example).items():
            Image.fromarray(pixels).save(folder / name / f"{view}.png", optimize=True)
