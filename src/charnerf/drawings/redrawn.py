"""A character whose source views are drawn, as somebody would, and read as drawings are: what is measured with known truth."""

from dataclasses import replace

from charnerf.data.characters import Character
from charnerf.drawings.artist import draw_character
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround

SIDE = 384  # pixels of the drawings: three of theirs to one that the model reads


def redrawn(character: Character, *, level: int, seed: int, size: int, reconciled: bool = True) -> Character:
    """Draw a character's front, side and back at a level of disagreement, and take the drawings for its source views.

    Args:
        character: With its mesh.
        level: As of `artist.draw_character`; at 0 it is returned as it is.
        seed: Of the artist.
        size: Side of the source views, pixels.
        reconciled: Whether views that disagree are mended.

    Raises:
        ConfigError: If there is no such level.
        DataError: If a drawing can not be read.
    """
    if level == 0:
        return character
    front, side, back = draw_character(character, size=SIDE, seed=seed, level=level).values()
    read = read_views(turnaround(front, side, back), size=size, reconciled=reconciled)
    return replace(character, sources=read.views)
