"""Other characters out of one: solids of any kind put on it as hats, hair, plates, packs and skirts.

Bodies that differ from all that were trained on are mostly bodies that wear something. What is worn has no meaning, so that a
network can not answer with what it knows of heads and backs. Where it goes is read off the outline (capture/part_swaps.py).
"""

from dataclasses import dataclass

import numpy as np

from charnerf.capture.outline import ROW_HEIGHT, ROWS
from charnerf.capture.part_swaps import CutSurface, joined, standing
from charnerf.procedural import make_colors, make_piece
from charnerf.surfaces.surface_mesh import SurfaceMesh

Range = tuple[float, float]


@dataclass(frozen=True)
class _Place:
    """Where something is worn.

    Attributes:
        share: Of the characters that wear it.
        of_head: Whether sizes are those of the head's box, else of the trunk's; half of them is 1.
        centre: In that box, -1 to 1: to the character's left, from front to back, from bottom to top.
        across: Range of its half width.
        deep: Of its half depth.
        high: Of its half height.
        both_sides: Whether it is worn on the other side too.
    """

    share: float
    of_head: bool
    centre: tuple[float, float, float]
    across: Range
    deep: Range
    high: Range
    both_sides: bool = False


_PLACES = (
    _Place(0.45, True, (0.0, 0.0, 0.75), (0.7, 1.6), (0.7, 1.6), (0.2, 0.7)),  # a hat, a helmet
    _Place(0.35, True, (0.0, 0.4, 0.1), (0.8, 1.5), (0.6, 1.1), (0.7, 1.5)),  # hair, a hood
    _Place(0.15, True, (0.9, 0.0, 0.2), (0.1, 0.5), (0.2, 0.7), (0.2, 0.8), both_sides=True),  # ears, horns
    _Place(0.35, False, (0.0, 0.0, 0.45), (0.95, 1.5), (0.95, 1.7), (0.3, 0.7)),  # a breastplate
    _Place(0.4, False, (1.0, 0.0, 0.85), (0.25, 0.7), (0.4, 1.1), (0.15, 0.4), both_sides=True),  # shoulders
    _Place(0.35, False, (0.0, 1.1, 0.2), (0.3, 1.1), (0.5, 1.5), (0.3, 1.0)),  # a pack, a shell
    _Place(0.35, False, (0.0, 0.0, -0.95), (1.0, 1.7), (1.0, 1.7), (0.1, 0.8)),  # a belt, a skirt
    _Place(0.15, False, (0.0, -1.0, 0.0), (0.3, 1.0), (0.2, 0.8), (0.2, 0.8)),  # a shield, a belly
)


def dress(surface: SurfaceMesh, rng: np.random.Generator) -> SurfaceMesh:
    """The character with one or more solids put on.

    Args:
        surface: World frame, 2 m tall, feet on z = 0.
        rng: What is drawn from.

    Returns:
        2 m tall again with what it wears, feet on z = 0, middle of its box on the z axis.
    """
    cut, colors = CutSurface(surface), make_colors(rng)
    top = float(surface.triangles[..., 2].max())
    boxes = {True: _box(cut, cut.neck, top), False: _box(cut, cut.hips, cut.neck)}
    chosen = rng.random(len(_PLACES)) < [place.share for place in _PLACES]
    if not chosen.any():
        chosen[int(rng.integers(len(_PLACES)))] = True
    worn = []
    for place in (place for place, is_worn in zip(_PLACES, chosen, strict=True) if is_worn):
        middle, half = boxes[place.of_head]
        size = half * [rng.uniform(*limits) for limits in (place.across, place.deep, place.high)]
        centre = middle + half * place.centre
        piece = make_piece(rng, colors, centre, size)
        worn += [piece, _mirrored(piece, float(middle[0]))] if place.both_sides else [piece]
    return standing(joined([surface, *worn]))


def _box(cut: CutSurface, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle and half sizes (3,) of what is between two heights, arms left out, m."""
    rows = slice(int(low / ROW_HEIGHT), max(int(low / ROW_HEIGHT) + 1, min(int(high / ROW_HEIGHT), ROWS)))
    heights = ROW_HEIGHT * (np.arange(rows.start, rows.stop) + 0.5)
    widths, depths = np.median([cut.widths(float(height)) for height in heights], axis=0)
    corners = cut.surface.triangles.reshape(-1, 3).astype(np.float64)
    near = (corners[:, 2] >= low) & (corners[:, 2] <= high) & (np.abs(corners[:, 0]) < 0.6 * widths)
    depth = float(np.median(corners[near, 1])) if near.any() else 0.0
    return np.array((0.0, depth, 0.5 * (low + high))), 0.5 * np.array((widths, depths, max(high - low, 0.05)))


def _mirrored(piece: SurfaceMesh, middle: float) -> SurfaceMesh:
    """A piece on the other side of the plane x = middle."""
    triangles = piece.triangles[:, ::-1].copy()
    triangles[..., 0] = 2.0 * middle - triangles[..., 0]
    return SurfaceMesh(
        triangles, piece.uvs[:, ::-1], piece.colors[:, ::-1], piece.material_ids, piece.materials
    )
