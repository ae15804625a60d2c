"""Other characters out of several: the head of one, the body of another, the legs of a third.

Each is bent into other proportions first (capture/variants.py), then cut across at the neck and at the hips, where its
own outline shows them; most of what is joined lowers its arms. What a network learns of one part can then not be told
from another part of the character.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from charnerf.capture.arms import find_arms
from charnerf.capture.outline import CELL_WIDTH, COLUMNS, ROW_HEIGHT, ROWS, middle_runs
from charnerf.capture.variants import REACH, bent, posed, stand
from charnerf.errors import DataError
from charnerf.surfaces.surface_mesh import SurfaceMesh

# Shares of the height: where the widest row is taken for the shoulders if no arms are held out; how far above them a neck is looked
# for; where a gap between the legs is.
_SHOULDERS = (0.35, 0.7)
_NECK = 0.08
_HIPS = (0.12, 0.5)
_FIT = (0.6, 1.7)  # smallest and largest factor that fits a part's width to the body's


def swap_parts(characters: Sequence[SurfaceMesh], rng: np.random.Generator) -> SurfaceMesh:
    """One character with the body of the first, the head of the second and the legs of the third.

    Args:
        characters: Three, world frame, 2 m tall; the same one may stand in several places.
        rng: What proportions are drawn from.

    Returns:
        2 m tall, feet on z = 0, middle of its box on the z axis, reaching no farther than 1.5 m to a side.

    Raises:
        DataError: If one of the parts has no surface.
    """
    body, head, legs = (CutSurface(bent(one, rng)) for one in characters)
    parts = {
        "body": slab(body.surface, body.hips, body.neck),
        "head": _fitted(
            slab(head.surface, head.neck, np.inf), head.widths(head.neck), body.widths(body.neck), head.neck
        ),
        "legs": _fitted(
            slab(legs.surface, -np.inf, legs.hips), legs.widths(legs.hips), body.widths(body.hips), legs.hips
        ),
    }
    missing = [name for name, part in parts.items() if not len(part.triangles)]
    if missing:
        raise DataError(
            f"swap of parts: nothing of the character is its {missing[0]}; leave it out of the swaps."
        )
    raised = _placed(parts["head"], 1.0, body.neck - head.neck)
    lengthened = _placed(parts["legs"], body.hips / legs.hips, 0.0)
    together = joined([parts["body"], raised, lengthened])
    return standing(posed(standing(together), rng))


def standing(surface: SurfaceMesh) -> SurfaceMesh:
    """A surface brought to 2 m, feet on z = 0, middle of its box on the z axis, reaching no farther than 1.5 m to a side."""
    triangles = stand(surface.triangles.astype(np.float64), reach=np.array((REACH, REACH)))
    return replace(surface, triangles=triangles.astype(np.float32))


class CutSurface:
    """A surface and where its outline from the front would be cut.

    Attributes:
        surface: World frame, 2 m tall.
        runs: Its `middle_runs`.
        neck: Height of the narrowest row above the arms, or above the widest row where they hang, m.
        hips: Height of the highest gap between the legs, or a third of the height where there is none, m.
    """

    def __init__(self, surface: SurfaceMesh) -> None:
        self.surface = surface
        self.runs = middle_runs(surface)
        arms = find_arms(surface, self.runs)
        low, high = (round(share * ROWS) for share in _SHOULDERS)
        shoulders = low + int(np.argmax(self.runs[low:high])) if arms is None else int(arms.high / ROW_HEIGHT)
        above = self.runs[shoulders : shoulders + round(_NECK * ROWS)]
        self.neck = _height_of_row(shoulders + int(np.argmin(np.where(above > 0, above, COLUMNS))))
        low, high = (round(share * ROWS) for share in _HIPS)
        gap = np.flatnonzero(self.runs[low:high] == 0)
        self.hips = _height_of_row(low + int(gap.max()) + 1 if len(gap) else round(ROWS / 3))

    def widths(self, height: float) -> np.ndarray:
        """Extent in x and y near a height, arms left out, m, (2,)."""
        corners = self.surface.triangles.reshape(-1, 3)
        run = max(1, self.runs[min(int(height / ROW_HEIGHT), ROWS - 1)]) * (0.5 * CELL_WIDTH)
        near = corners[(np.abs(corners[:, 2] - height) < 0.12) & (np.abs(corners[:, 0]) < 1.2 * run)]
        depth = np.ptp(near[:, 1]) if len(near) > 3 else 0.2
        return np.maximum(np.array((2.0 * run, depth)), 0.05)


def _height_of_row(row: int) -> float:
    return (row + 0.5) * ROW_HEIGHT


def _fitted(part: SurfaceMesh, widths: np.ndarray, wanted: np.ndarray, height: float) -> SurfaceMesh:
    """A part scaled about a height, by the mean of what both widths ask for (heads are round)."""
    low, high = _FIT
    factor = np.clip(np.sqrt(np.prod(wanted / widths)), low, high)
    about = np.array((0.0, 0.0, height), np.float32)
    return replace(part, triangles=(part.triangles - about) * np.float32(factor) + about)


def _placed(part: SurfaceMesh, factor: float, offset: float) -> SurfaceMesh:
    """A part with its heights scaled, then raised."""
    factors, offsets = np.array((1.0, 1.0, factor), np.float32), np.array((0.0, 0.0, offset), np.float32)
    return replace(part, triangles=part.triangles * factors + offsets)


def slab(surface: SurfaceMesh, low: float, high: float) -> SurfaceMesh:
    """What of a surface lies between two heights, m; triangles across them are cut."""
    corners = np.concatenate((surface.triangles, surface.uvs, surface.colors), axis=-1)
    ids = surface.material_ids
    if np.isfinite(low):
        corners, ids = _above(corners, ids, low, 1.0)
    if np.isfinite(high):
        corners, ids = _above(corners, ids, high, -1.0)
    order = np.argsort(ids, kind="stable")
    corners = corners[order].astype(np.float32)
    return replace(
        surface,
        triangles=corners[..., :3],
        uvs=corners[..., 3:5],
        colors=corners[..., 5:],
        material_ids=ids[order],
    )


def _above(corners: np.ndarray, ids: np.ndarray, height: float, sign: float) -> tuple[np.ndarray, np.ndarray]:
    """The side of triangles (M, 3, C) above a height (sign 1) or below it (-1); C starts with the place."""
    distance = sign * (corners[..., 2] - height)
    inside = distance >= 0.0
    count = inside.sum(axis=1)
    kept, kept_ids = [corners[count == 3]], [ids[count == 3]]
    for lonely, few in ((1, True), (2, False)):  # corners inside; the lonely one is turned to the front
        crossing = count == lonely
        turn = np.argmax(inside[crossing] == few, axis=1)
        turned = (turn[:, None] + np.arange(3)) % 3
        triangle = np.take_along_axis(corners[crossing], turned[..., None], axis=1)
        to_plane = np.take_along_axis(distance[crossing], turned, axis=1)
        share = to_plane[:, :1] / (to_plane[:, :1] - to_plane[:, 1:])
        cut = triangle[:, :1] + share[..., None] * (triangle[:, 1:] - triangle[:, :1])
        if few:
            kept += [np.stack((triangle[:, 0], cut[:, 0], cut[:, 1]), axis=1)]
            kept_ids += [ids[crossing]]
        else:
            kept += [
                np.stack((cut[:, 0], triangle[:, 1], triangle[:, 2]), axis=1),
                np.stack((cut[:, 0], triangle[:, 2], cut[:, 1]), axis=1),
            ]
            kept_ids += [ids[crossing]] * 2
    return np.concatenate(kept), np.concatenate(kept_ids)


def joined(parts: Sequence[SurfaceMesh]) -> SurfaceMesh:
    """Several surfaces as one."""
    starts = np.cumsum([0, *(len(part.materials) for part in parts)])
    return SurfaceMesh(
        triangles=np.concatenate([part.triangles for part in parts]),
        uvs=np.concatenate([part.uvs for part in parts]),
        colors=np.concatenate([part.colors for part in parts]),
        material_ids=np.concatenate(
            [part.material_ids + np.int32(start) for part, start in zip(parts, starts, strict=False)]
        ),
        materials=tuple(material for part in parts for material in part.materials),
    )
