"""Polygons in space to triangles: convex ones as fans, concave ones by ear clipping (mapbox earcut)."""

from collections.abc import Sequence

import numpy as np

from charnerf.errors import DataError

MOST_CORNERS = 10_000  # of a polygon; ears are clipped in the square of it
_QUAD = np.array(((0, 1, 2), (2, 3, 0)))


def triangulate(vertices: np.ndarray, polygons: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Triangles of polygons, which may be concave, turned as the polygon is.

    Args:
        vertices: Positions (n, 3).
        polygons: The vertices' indices of each, (k,), k at least 3.

    Returns:
        Of each polygon the corners of its triangles, (m, 3), as places in the polygon: 0 to k - 1.

    Raises:
        DataError: If a vertex is not there, or a polygon has more corners than anybody models.
    """
    largest = max(map(len, polygons), default=0)
    if largest > MOST_CORNERS:
        raise DataError(
            f"a face has {largest} corners, expected at most {MOST_CORNERS}; export it as triangles."
        )
    if any(polygon.min() < 0 or polygon.max() >= len(vertices) for polygon in polygons):
        raise DataError(f"a face names a vertex that is not one of {len(vertices)}; export it again.")
    triangles: list[np.ndarray] = [np.zeros((0, 3), np.int64)] * len(polygons)
    sizes = np.array([len(polygon) for polygon in polygons])
    for size in np.unique(sizes):
        chosen = np.flatnonzero(sizes == size).tolist()
        points = vertices[np.stack([polygons[index] for index in chosen])]
        normals, is_concave = _shapes(points)
        for index, corners, normal, concave in zip(chosen, points, normals, is_concave, strict=True):
            triangles[index] = _clip_ears(corners, normal) if concave else _fan(size)
    return triangles


def _shapes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals (g, 3), twice the area long, of polygons (g, k, 3), and which of them turn back somewhere."""
    points = points - points[:, :1]
    following = np.roll(points, -1, axis=1)
    normals = np.cross(points, following).sum(axis=1)
    edges = following - points
    turns = np.einsum("gki,gi->gk", np.cross(np.roll(edges, 1, axis=1), edges), normals)
    return normals, (turns < -1e-6 * (normals**2).sum(axis=1, keepdims=True)).any(axis=1)


def _fan(size: int) -> np.ndarray:
    if size == 4:
        return _QUAD
    middle = np.arange(1, size - 1)
    return np.stack((np.zeros_like(middle), middle, middle + 1), axis=-1)


def _clip_ears(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    import mapbox_earcut

    axis = int(np.abs(normal).argmax())
    flat = np.ascontiguousarray(points[:, [(axis + 1) % 3, (axis + 2) % 3]])
    corners = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    triangles = np.asarray(corners, dtype=np.int64).reshape(-1, 3)
    if not len(triangles):
        return _fan(len(points))
    first, second, third = np.moveaxis(flat[triangles], 1, 0)
    a, b = second - first, third - first
    turned = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * normal[axis] < 0.0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles
