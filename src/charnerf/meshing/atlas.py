"""UV atlases: a surface laid flat in charts, and what of it each texel of a square texture shows.

Letters: P vertices, Q vertices after those on seams were split, T triangles, K texels that show surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
import xatlas

from charnerf.errors import DataError

PIECE = 5000  # faces unwrapped at once: the time xatlas takes grows with their square
MOST_FACES = 200_000
PADDING = 4  # texels between charts
CANDIDATES = 4_000_000  # texels looked at at once, which bounds memory


@dataclass(frozen=True)
class Atlas:
    """A surface cut along seams and laid flat.

    Attributes:
        vertex_of: Which vertex of the surface each split vertex is, (Q,).
        faces: Split vertices of each triangle, (T, 3), in the surface's order of triangles.
        uv: Place of each split vertex in the unit square, (Q, 2), v upwards.
    """

    vertex_of: np.ndarray
    faces: np.ndarray
    uv: np.ndarray


@dataclass(frozen=True)
class Texels:
    """The texels of a texture that show surface.

    Attributes:
        index: Row times size plus column, (K,); row 0 is the top, v = 1.
        face: Triangle that a texel's centre lies in, (K,).
        weights: Barycentric weights of its corners, (K, 3).
    """

    index: np.ndarray
    face: np.ndarray
    weights: np.ndarray


def unwrap(mesh: trimesh.Trimesh, size: int) -> Atlas:
    """Lay a surface flat for a texture of size x size texels.

    Raises:
        DataError: If the size is out of range, or there are too many faces to unwrap in reasonable time.
    """
    if not 16 <= size <= 8192:
        raise DataError(f"texture size: found {size}, expected 16 to 8192 texels a side.")
    if len(mesh.faces) > MOST_FACES:
        raise DataError(
            f"texture: found {len(mesh.faces)} faces, expected at most {MOST_FACES} to unwrap. Ask for fewer "
            "faces, or for vertex colours."
        )
    atlas = xatlas.Atlas()
    vertices, faces = np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces)
    pieces = _pieces(np.asarray(mesh.triangles_center))
    used = [np.unique(faces[piece], return_inverse=True) for piece in pieces]
    for names, local in used:
        atlas.add_mesh(vertices[names], local.reshape(-1, 3).astype(np.uint32))
    options = xatlas.PackOptions()
    options.resolution, options.padding, options.bilinear = size, PADDING, True
    atlas.generate(pack_options=options)
    split_faces, vertex_of, uv = np.zeros((len(faces), 3), np.int64), [], []
    count = 0
    for number, (piece, (names, _)) in enumerate(zip(pieces, used, strict=True)):
        mapping, indices, coordinates = atlas[number]
        split_faces[piece] = indices.astype(np.int64).reshape(-1, 3) + count
        vertex_of.append(names[mapping])
        uv.append(coordinates)
        count += len(mapping)
    upward = np.concatenate(uv).astype(np.float64)
    upward[:, 1] = 1.0 - upward[:, 1]
    return Atlas(np.concatenate(vertex_of), split_faces, upward)


def rasterise(atlas: Atlas, size: int) -> Texels:
    """Find the triangle and the place in it of every texel centre that a chart covers."""
    corners = np.stack((atlas.uv[:, 0] * size, (1.0 - atlas.uv[:, 1]) * size), axis=1)[atlas.faces]
    low = np.clip(np.ceil(corners.min(1) - 0.5), 0, size).astype(np.int64)
    high = np.clip(np.floor(corners.max(1) - 0.5) + 1, 0, size).astype(np.int64)
    extent = np.maximum(high - low, 0)
    counts = extent.prod(1)
    covered = [
        _inside(corners, low, extent, counts, chosen, size) for chosen in _batches(counts) if len(chosen)
    ]
    index, face, weights = (np.concatenate(parts) for parts in zip(*covered, strict=True))
    _, first = np.unique(index, return_index=True)  # a centre on an edge belongs to one triangle
    return Texels(index[first], face[first], weights[first])


def _pieces(centres: np.ndarray) -> list[np.ndarray]:
    """Triangles by place, as lists of at most PIECE, cut across the longest side of their bounds."""
    done, waiting = [], [np.arange(len(centres))]
    while waiting:
        piece = waiting.pop()
        if len(piece) <= PIECE:
            done.append(piece)
            continue
        axis = int(np.argmax(np.ptp(centres[piece], axis=0)))
        order = np.argsort(centres[piece, axis], kind="stable")
        half = len(piece) // 2
        waiting += [piece[order[:half]], piece[order[half:]]]
    return done


def _batches(counts: np.ndarray) -> list[np.ndarray]:
    """Triangles in groups whose texels together are not many more than CANDIDATES."""
    group = np.cumsum(counts) // CANDIDATES
    return np.split(np.arange(len(counts)), np.flatnonzero(np.diff(group)) + 1)


def _inside(
    corners: np.ndarray,
    low: np.ndarray,
    extent: np.ndarray,
    counts: np.ndarray,
    chosen: np.ndarray,
    size: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Texels of some triangles' bounds whose centres lie inside: texel, triangle, weights."""
    face = np.repeat(chosen, counts[chosen])
    within = np.arange(len(face)) - np.repeat(np.cumsum(counts[chosen]) - counts[chosen], counts[chosen])
    row = low[face, 1] + within // np.maximum(extent[face, 0], 1)
    column = low[face, 0] + within % np.maximum(extent[face, 0], 1)
    a, b, c = (corners[face, k] for k in range(3))
    point = np.stack((column + 0.5, row + 0.5), axis=1)
    area = _cross(b - a, c - a)
    sound = np.abs(area) > 1e-12
    safe = np.where(sound, area, 1.0)
    second, third = _cross(point - a, c - a) / safe, _cross(b - a, point - a) / safe
    weights = np.stack((1.0 - second - third, second, third), axis=1)
    inside = sound & (weights >= -1e-9).all(1)
    return (row * size + column)[inside], face[inside], weights[inside]


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
