"""A character whose source views are drawn, as somebody would, and read as drawings are: what is measured with known truth."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from charnerf.data.characters import Character, CharacterPictures
from charnerf.drawings.artist import LEVELS, captured, draw_character, on_paper
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import Viewpoint, turnaround, viewpoint
from charnerf.pictures import to_bytes
from charnerf.surfaces.surface_mesh import SurfaceMesh

SIDE = 384  # pixels of the drawings: three of theirs to one that the model reads
LEVEL_SHARES = {1: 0.35, 2: 0.4, 3: 0.25}  # of training's drawings
VIEW_SHARES = {  # of training's turnarounds, by the views that they have
    ("front", "left"): 0.15,
    ("front", "left", "back"): 0.45,
    ("front", "right", "back"): 0.1,
    ("front", "left", "back", "right"): 0.15,
    ("front", "left", "back", "three-quarter-front"): 0.15,
}


def redrawn(
    character: Character,
    *,
    level: int,
    seed: int,
    size: int,
    views: Sequence[Viewpoint] | None = None,
    options: ReadingOptions | None = None,
) -> Character:
    """Draw views of a character at a level of disagreement, and take the drawings for its source views.

    Args:
        character: With its mesh.
        level: As of `artist.draw_character`.
        seed: Of the artist.
        size: Side of the source views, pixels.
        views: Level ones; None for front, left and back. At level 0 these are returned as they were captured.
        options: How the drawings are read.

    Raises:
        ConfigError: If there is no such level.
        DataError: If a drawing can not be read, or there is no mesh to draw further views of.
    """
    if views is None and level == 0:
        return character
    azimuths = None if views is None else {_stored_name(view.name): view.azimuth_deg for view in views}
    drawn = draw_character(character, size=SIDE, seed=seed, level=level, azimuths_deg=azimuths).values()
    drawings = turnaround(*drawn) if views is None else dict(zip(views, drawn, strict=True))
    read = read_views(drawings, size=size, options=options)
    return replace(character, sources=read.views, source_names=tuple(map(_stored_name, read.names)))


def with_drawn_sources(
    pictures: CharacterPictures, surface: SurfaceMesh, rng: np.random.Generator
) -> CharacterPictures:
    """Captured pictures with drawings of some of the usual views for source views, for training.

    Level and views are drawn by LEVEL_SHARES and VIEW_SHARES; the drawings are read, aligned and reconciled as a user's are.

    Args:
        pictures: As captured; targets stay.
        surface: What was captured, in the pose of the front view.
        rng: What all is drawn from.

    Raises:
        DataError: If a drawing can not be read.
    """
    level = rng.choice(list(LEVEL_SHARES), p=list(LEVEL_SHARES.values()))
    choices = list(VIEW_SHARES)
    views = [viewpoint(name) for name in choices[rng.choice(len(choices), p=list(VIEW_SHARES.values()))]]
    size = pictures.source_images.shape[1]
    mistakes = LEVELS[level]
    images = captured(surface, [view.azimuth_deg for view in views], size=SIDE, mistakes=mistakes, rng=rng)
    drawings = on_paper(images, mistakes, seed=int(rng.integers(2**31)))
    read = read_views(dict(zip(views, drawings, strict=True)), size=size)
    return replace(
        pictures,
        source_cameras=read.views.cameras[0],
        source_images=to_bytes(read.views.images[0].permute(0, 2, 3, 1)),
        source_names=tuple(map(_stored_name, read.names)),
    )


def _stored_name(name: str) -> str:
    """Name of a view in a data set: `side` is what most turnarounds call the left one."""
    return "side" if name == "left" else name
