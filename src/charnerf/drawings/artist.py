"""Drawings of a data set's characters: what somebody would have drawn of them, on paper."""

import hashlib
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from charnerf.capture.character import capture_sources
from charnerf.data.characters import Character
from charnerf.data.drawing_style import draw_pictures, random_style
from charnerf.geometry.framing import SOURCE_ORDER
from charnerf.pictures import save_png
from charnerf.surfaces.mesh_files import load_surface_mesh

PAPER = (252, 251, 247)
MISTAKES = {"wobble": 0.006, "shift": 0.01, "scale": 0.015}  # as conf/augmentation/drawing.yaml


def draw_character(character: Character, *, size: int, seed: int) -> dict[str, np.ndarray]:
    """Draw a character in one style for all views.

    Args:
        character: With its mesh; one without is drawn from its source views, at their size.
        size: Side of the drawings, pixels.
        seed: Of the style and of the hand; another character has another style at the same seed.

    Returns:
        RGB uint8 (size, size, 3) on paper, by the name of the view.
    """
    if character.mesh_file is None:
        names, images = character.source_names, character.sources.images[0]
    else:
        names = SOURCE_ORDER
        pictures = capture_sources(load_surface_mesh(character.mesh_file), size)
        images = torch.from_numpy(pictures).permute(0, 3, 1, 2).float() / 255.0
    digest = hashlib.sha256(f"{seed} {character.name}".encode()).digest()
    generator = torch.Generator().manual_seed(int.from_bytes(digest[:7], "little"))
    drawn = draw_pictures(images, random_style(generator, **MISTAKES), generator)
    paper = torch.tensor(PAPER)[:, None, None] / 255.0
    rgb = drawn[:, :3] * drawn[:, 3:] + paper * (1.0 - drawn[:, 3:])
    pixels = (255.0 * rgb).round().to(torch.uint8).permute(0, 2, 3, 1).numpy()
    return dict(zip(names, pixels, strict=True))


def write_drawings(drawings: dict[str, np.ndarray], folder: Path) -> list[Path]:
    """Write FOLDER/front.png, side.png, back.png."""
    files = [folder / f"{name}.png" for name in drawings]
    for file, pixels in zip(files, drawings.values(), strict=True):
        save_png(file, Image.fromarray(pixels))
    return files
