"""Making a decimated surface a manifold again: no folded faces, every edge between exactly two.

Decimation may fold two faces onto each other, or weld two sheets along an edge, so that four faces meet.
The former are removed, the latter taken apart: vertices are split, nothing moves.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

MOST_ROUNDS = 4


def make_manifold(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Remove folded pairs of faces and take welded sheets apart.

    Args:
        vertices: (P, 3).
        faces: (T, 3), consistently oriented, every directed edge as often as its reverse.

    Returns:
        Vertices and faces of the same surface; each edge belongs to two faces, and the faces around each
        vertex are connected through such edges. Where two edges join the same two vertices, one gets its
        middle as a further vertex.
    """
    vertices, faces = np.asarray(vertices, np.float64), _without_folds(np.asarray(faces, np.int64))
    vertices, faces, pairs = _split(vertices, faces)
    for _ in range(MOST_ROUNDS):
        double = _double_edges(faces, pairs)
        if len(double) == 0:
            break
        vertices, faces = _with_middles(vertices, faces, double)
        vertices, faces, pairs = _split(vertices, faces)
    return vertices, faces


def _split(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give each fan of faces around a vertex a vertex of its own; also the pairs of edges (E, 2) that meet.

    An edge of face f is named 3 f + k and runs from corner k to corner k + 1.
    """
    pairs = _paired_edges(vertices, faces)
    first, second = pairs.T
    one, other = np.concatenate((first, _next(first))), np.concatenate((_next(second), second))
    links = coo_array((np.ones(len(one), bool), (one, other)), shape=(faces.size, faces.size))
    _, corner_vertex = connected_components(links, directed=False)
    split = np.zeros((int(corner_vertex.max()) + 1, 3))
    split[corner_vertex] = vertices[faces.reshape(-1)]
    return split, corner_vertex.reshape(-1, 3), pairs


def _double_edges(faces: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Pairs whose two vertices another pair joins as well, no two of the same faces and vertices."""
    ends = np.sort(
        np.stack((faces.reshape(-1)[pairs[:, 0]], faces.reshape(-1)[_next(pairs[:, 0])]), axis=1), axis=1
    )
    _, index, counts = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    chosen: list[int] = []
    used: set[int] = set()
    joined: set[tuple[int, ...]] = set()
    for place in np.flatnonzero(counts[index.reshape(-1)] > 1):
        touched = {int(edge) // 3 for edge in pairs[place]}
        if not touched & used and (key := tuple(ends[place])) not in joined:
            chosen.append(int(place))
            used |= touched
            joined.add(key)
    return pairs[chosen]


def _with_middles(
    vertices: np.ndarray, faces: np.ndarray, pairs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Divide both faces at each given pair of edges by the edge's middle."""
    new_vertices: list[np.ndarray] = []
    new_faces: list[tuple[int, int, int]] = []
    gone: list[int] = []
    for pair in pairs:
        middle = len(vertices) + len(new_vertices)
        for edge in pair:
            face, corner = divmod(int(edge), 3)
            a, b, c = (faces[face, (corner + k) % 3] for k in range(3))
            new_faces += [(a, middle, c), (middle, b, c)]
            gone.append(face)
        new_vertices.append(0.5 * (vertices[a] + vertices[b]))
    kept = np.delete(faces, gone, axis=0)
    return np.vstack((vertices, new_vertices)), np.vstack((kept, new_faces))


def _next(edges: np.ndarray) -> np.ndarray:
    """The corner at the end of an edge."""
    return edges - edges % 3 + (edges + 1) % 3


def _without_folds(faces: np.ndarray) -> np.ndarray:
    """Faces without degenerate ones and without those that lie on one another; of an odd number one stays."""
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    _, index, counts = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    repeated = counts[index.reshape(-1)] > 1
    if not repeated.any():
        return faces
    kept = ~repeated
    groups: dict[tuple[int, ...], list[int]] = {}
    for face in np.flatnonzero(repeated):
        groups.setdefault(tuple(sorted(faces[face])), []).append(int(face))
    for members in groups.values():
        if len(members) % 2:
            kept[members[0]] = True
    return faces[kept]


def _paired_edges(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which edges (E, 2) of faces meet: each with one that runs the other way between the same vertices."""
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    key = np.minimum(start, end) * len(vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    bounds = np.flatnonzero(np.diff(key[order], prepend=-1))
    counts = np.diff(np.append(bounds, len(order)))
    simple = bounds[counts == 2]
    pairs = [np.stack((order[simple], order[simple + 1]), axis=1)]
    for begin, count in zip(bounds[counts > 2], counts[counts > 2], strict=True):
        group = order[begin : begin + count]
        forward, backward = group[start[group] < end[group]], list(group[start[group] > end[group]])
        for edge in forward[: len(backward)]:
            # the flattest continuation is the likeliest to be the same sheet
            flat = [
                _fold(vertices, faces, edge) @ _fold(vertices, faces, candidate) for candidate in backward
            ]
            pairs.append(np.array([[edge, backward.pop(int(np.argmin(flat)))]]))
    return np.concatenate(pairs)


def _fold(vertices: np.ndarray, faces: np.ndarray, edge: int) -> np.ndarray:
    """Unit direction from an edge into its face, (3,)."""
    face, corner = divmod(int(edge), 3)
    a, b, c = (vertices[faces[face, (corner + k) % 3]] for k in range(3))
    along = b - a
    into = (c - a) - along * ((c - a) @ along) / max(along @ along, 1e-30)
    return into / max(float(np.linalg.norm(into)), 1e-30)
