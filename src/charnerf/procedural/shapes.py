"""Closed shapes that characters are made of: lofts, sheets, slabs.

World frame: metres, +Z up, the character faces -Y, its left is +X. A texture's u runs around a shape: 0.5 is
the front, the seam is at the back, and u grows towards the picture's right for someone looking at the front;
v runs from the path's start to its end.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

FRONT = np.array((0.0, -1.0, 0.0))
UP = np.array((0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Shape:
    """A closed surface: vertices (n, 3) m, faces (f, 3) turned outwards, uv of face corners (f, 3, 2)."""

    vertices: Array
    faces: NDArray[np.int64]
    uv: Array

    def moved(self, matrix: ArrayLike, offset: ArrayLike = (0.0, 0.0, 0.0)) -> "Shape":
        """Apply a linear map (3, 3), then an offset (3,), keeping the faces turned outwards."""
        linear = np.asarray(matrix, dtype=np.float64)
        vertices = self.vertices @ linear.T + np.asarray(offset, dtype=np.float64)
        if np.linalg.det(linear) < 0.0:
            return Shape(vertices, self.faces[:, ::-1], self.uv[:, ::-1])
        return Shape(vertices, self.faces, self.uv)

    def mirrored(self) -> "Shape":
        """The mirror image in the plane x = 0; its texture is mirrored with it."""
        return self.moved(np.diag((-1.0, 1.0, 1.0)))


def unit(vector: ArrayLike) -> Array:
    """A vector of length 1."""
    values = np.asarray(vector, dtype=np.float64)
    return values / np.linalg.norm(values)


def rotation(axis: ArrayLike, angle_deg: float) -> Array:
    """Right-handed rotation matrix (3, 3) about an axis."""
    x, y, z = unit(axis)
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    angle = np.deg2rad(angle_deg)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def around(sides: int) -> Array:
    """U in [0, 1) of a cross-section's corners: 4 sides give a box whose front is u in [0.375, 0.625]."""
    if sides == 4:
        return np.array((0.0, 0.125, 0.375, 0.625, 0.875))
    return np.arange(sides) / sides


def cross_section(u: Array, power: float, sides: int) -> Array:
    """Points (len(u), 2), sideways and forwards, of a superellipse: power 2 an ellipse, large a box."""
    angle = 2.0 * np.pi * (u - 0.5)
    wave = np.stack((np.sin(angle), np.cos(angle)), axis=-1)
    wave[np.abs(wave) < 1e-12] = 0.0
    if sides == 4:
        return np.sign(wave)
    return wave / (np.abs(wave) ** power).sum(axis=-1, keepdims=True) ** (1.0 / power)


def _frames(centres: Array, front: Array, axis: Array | None) -> tuple[Array, Array, Array]:
    """Tangents, sideways and forward axes (k, 3) of a path."""
    tangents = np.gradient(centres, axis=0) if axis is None else np.broadcast_to(axis, centres.shape).copy()
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    sideways = np.cross(tangents, front)
    sideways /= np.linalg.norm(sideways, axis=-1, keepdims=True)
    return tangents, sideways, np.cross(sideways, tangents)


def loft(
    centres: ArrayLike,
    radii: ArrayLike,
    *,
    front: ArrayLike = FRONT,
    axis: ArrayLike | None = None,
    sides: int = 12,
    power: float = 2.0,
    bulge: tuple[float, float] = (0.0, 0.0),
    along: ArrayLike | None = None,
) -> Shape:
    """Cross-sections joined along a path, closed by a fan at either end.

    Args:
        centres: Path, (k, 3), m.
        radii: Half sizes sideways and forwards, (k, 2) or (k,), m.
        front: Direction of u = 0.5, not parallel to the path.
        axis: Common normal of all cross-sections; None takes the path's tangents.
        sides: Corners of a cross-section; 4 is a box.
        power: Superellipse exponent: 2 an ellipse, large a box.
        bulge: How far the fans' tips stand out at start and end, m.
        along: v of each cross-section; None spreads [0, 1] by length.

    Returns:
        The closed shape.
    """
    path = np.asarray(centres, dtype=np.float64)
    sizes = np.asarray(radii, dtype=np.float64)
    sizes = np.stack((sizes, sizes), axis=-1) if sizes.ndim == 1 else sizes
    normal = None if axis is None else unit(axis)
    tangents, sideways, forwards = _frames(path, unit(front), normal)
    u = around(sides)
    section = cross_section(u, power, sides)
    rings = path[:, None] + (sizes[:, None, :1] * section[None, :, :1]) * sideways[:, None]
    rings = rings + (sizes[:, None, 1:] * section[None, :, 1:]) * forwards[:, None]
    if along is None:
        steps = (
            np.linalg.norm(np.diff(path, axis=0), axis=-1)
            + np.linalg.norm(np.diff(sizes, axis=0), axis=-1) * 0.5
        )
        v = np.concatenate(([0.0], np.cumsum(steps)))
        v = v / max(v[-1], 1e-9)
    else:
        v = np.asarray(along, dtype=np.float64)
    tips = np.stack((path[0] - bulge[0] * tangents[0], path[-1] + bulge[1] * tangents[-1]))
    return _skin(rings, u, v, tips)


def _skin(rings: Array, u: Array, v: Array, tips: Array) -> Shape:
    """Faces of rings (k, n, 3) with fans to the two tips (2, 3)."""
    count, width = rings.shape[:2]
    u_edges = np.append(u, 1.0)
    level = np.repeat(np.arange(count - 1), width)
    column = np.tile(np.arange(width), count - 1)
    following = (column + 1) % width
    corner = level * width
    a, b, c, d = corner + column, corner + following, corner + width + following, corner + width + column
    sides_faces = np.concatenate((np.stack((a, b, c), axis=-1), np.stack((a, c, d), axis=-1)))
    left, right, low, high = u_edges[column], u_edges[column + 1], v[level], v[level + 1]
    uv_a, uv_b = np.stack((left, low), axis=-1), np.stack((right, low), axis=-1)
    uv_c, uv_d = np.stack((right, high), axis=-1), np.stack((left, high), axis=-1)
    sides_uv = np.concatenate((np.stack((uv_a, uv_b, uv_c), axis=1), np.stack((uv_a, uv_c, uv_d), axis=1)))
    edge = np.arange(width)
    after = (edge + 1) % width
    bottom, top = count * width, count * width + 1
    middle = 0.5 * (u_edges[:-1] + u_edges[1:])
    last = (count - 1) * width
    start = np.stack((after, edge, np.full(width, bottom)), axis=-1)
    end = np.stack((last + edge, last + after, np.full(width, top)), axis=-1)
    start_uv = np.stack((u_edges[1:], u_edges[:-1], middle), axis=-1)
    end_uv = np.stack((u_edges[:-1], u_edges[1:], middle), axis=-1)
    start_uv = np.stack((start_uv, np.full_like(start_uv, v[0])), axis=-1)
    end_uv = np.stack((end_uv, np.full_like(end_uv, v[-1])), axis=-1)
    return Shape(
        np.concatenate((rings.reshape(-1, 3), tips)),
        np.concatenate((sides_faces, start, end)).astype(np.int64),
        np.concatenate((sides_uv, start_uv, end_uv)),
    )


def ball(
    centre: ArrayLike,
    radii: ArrayLike,
    *,
    sides: int = 12,
    rings: int = 8,
    power: float = 2.0,
    front: ArrayLike = FRONT,
) -> Shape:
    """An ellipsoid, or a rounded box at a larger power; radii are (x, y, z), m."""
    half = np.broadcast_to(np.asarray(radii, dtype=np.float64), (3,))
    angle = np.pi * (np.arange(rings) + 0.5) / rings
    height = -np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** (2.0 / power)
    width = np.sin(angle) ** (2.0 / power)
    centres = np.asarray(centre, dtype=np.float64) + np.outer(height * half[2], UP)
    sizes = np.outer(width, half[:2])
    tip = half[2] * (1.0 - np.abs(height[0]))
    return loft(
        centres,
        sizes,
        axis=UP,
        front=front,
        sides=sides,
        power=power,
        bulge=(tip, tip),
        along=0.5 + 0.5 * height,
    )


def box(centre: ArrayLike, half: ArrayLike, *, taper: float = 1.0) -> Shape:
    """An upright box with half sizes (x, y, z), m; its top is scaled by taper."""
    size = np.asarray(half, dtype=np.float64)
    middle = np.asarray(centre, dtype=np.float64)
    centres = middle + np.outer((-size[2], size[2]), UP)
    return loft(centres, np.stack((size[:2], size[:2] * taper)), sides=4, axis=UP)


def tube(
    points: ArrayLike, radii: ArrayLike, *, front: ArrayLike = FRONT, sides: int = 8, power: float = 2.0
) -> Shape:
    """A loft with rounded ends along a path."""
    sizes = np.asarray(radii, dtype=np.float64)
    ends = (float(np.mean(sizes[0])) * 0.5, float(np.mean(sizes[-1])) * 0.5)
    return loft(points, sizes, front=front, sides=sides, power=power, bulge=ends)


def lathe(
    centre: ArrayLike, profile: ArrayLike, *, depth: float = 1.0, sides: int = 12, power: float = 2.0
) -> Shape:
    """A solid of revolution about the vertical: profile (k, 2) of radius and height over the centre, m.

    The profile runs from bottom to top; depth scales the radius forwards.
    """
    line = np.asarray(profile, dtype=np.float64)
    centres = np.asarray(centre, dtype=np.float64) + np.outer(line[:, 1], UP)
    return loft(
        centres, np.stack((line[:, 0], line[:, 0] * depth), axis=-1), axis=UP, sides=sides, power=power
    )


def sheet(grid: ArrayLike, thickness: ArrayLike) -> Shape:
    """A surface given by points (m, n, 3), thickened by one or (m, n, 1) values; row 0 is v = 0, column 0 is u = 0.

    Seen from the side that its columns run to the right and its rows upwards, it is the front.
    """
    points = np.asarray(grid, dtype=np.float64)
    rows, columns = points.shape[:2]
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    half = 0.5 * np.asarray(thickness, dtype=np.float64) * normal
    outer, inner = points + half, points - half
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    face = np.concatenate((np.stack((a, b, c), axis=-1), np.stack((a, c, d), axis=-1)))
    rim = np.concatenate((index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]))
    following = np.roll(rim, -1)
    offset = rows * columns
    walls = np.concatenate(
        (
            np.stack((following, rim, rim + offset), axis=-1),
            np.stack((following, rim + offset, following + offset), axis=-1),
        )
    )
    faces = np.concatenate((face, face[:, ::-1] + offset, walls))
    v, u = np.meshgrid(np.linspace(0.0, 1.0, rows), np.linspace(0.0, 1.0, columns), indexing="ij")
    uv = np.stack((u.ravel(), v.ravel()), axis=-1)
    uv = np.concatenate((uv, uv))
    return Shape(np.concatenate((outer.reshape(-1, 3), inner.reshape(-1, 3))), faces, uv[faces])


def slab(outline: ArrayLike, thickness: float) -> Shape:
    """A plate in the plane y = 0: outline (k, 2) of x and z, m, star-shaped, anticlockwise from -Y."""
    line = np.asarray(outline, dtype=np.float64)
    count = len(line)
    low, high = line.min(axis=0), line.max(axis=0)
    flat = np.concatenate((line, line.mean(axis=0, keepdims=True)))
    front = np.stack((flat[:, 0], np.full(count + 1, -0.5 * thickness), flat[:, 1]), axis=-1)
    back = front * np.array((1.0, -1.0, 1.0))
    edge = np.arange(count)
    after = (edge + 1) % count
    fan = np.stack((edge, after, np.full(count, count)), axis=-1)
    offset = count + 1
    walls = np.concatenate(
        (
            np.stack((after, edge, edge + offset), axis=-1),
            np.stack((after, edge + offset, after + offset), axis=-1),
        )
    )
    faces = np.concatenate((fan, fan[:, ::-1] + offset, walls))
    uv = (flat - low) / np.maximum(high - low, 1e-9)
    uv = np.concatenate((uv, uv))
    return Shape(np.concatenate((front, back)), faces, uv[faces])
