"""A character's outline from the front, as rows: where its neck, hips and arms are."""

import numpy as np

from charnerf.errors import DataError
from charnerf.geometry.world import HEIGHT
from charnerf.surfaces.surface_mesh import SurfaceMesh, interpolate, triangle_areas

ROWS, COLUMNS = 80, 80
REACH = 1.6  # m: half the width looked at
ROW_HEIGHT, CELL_WIDTH = HEIGHT / ROWS, 2.0 * REACH / COLUMNS  # m
_POINTS = 40000


def middle_runs(surface: SurfaceMesh) -> np.ndarray:
    """Cells of each row of the front view that hang together with the middle, feet first, (ROWS,); 0 where it is empty.

    Raises:
        DataError: If the surface has no area.
    """
    rng = np.random.default_rng(0)
    areas = triangle_areas(surface)
    if not areas.sum() > 0.0:
        raise DataError("mesh: found an area of 0 m^2, expected triangles with area; export it again.")
    chosen = rng.choice(len(areas), _POINTS, p=areas / areas.sum())
    u, v = rng.random((2, len(chosen)))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    x, _, z = interpolate(surface.triangles[chosen].astype(np.float64), u, v).T
    counts, _, _ = np.histogram2d(z, x, (ROWS, COLUMNS), ((0.0, HEIGHT), (-REACH, REACH)))
    covered, middle = counts > 0, COLUMNS // 2
    right = np.cumprod(covered[:, middle:], axis=1).sum(axis=1)
    left = np.cumprod(covered[:, middle - 1 :: -1], axis=1).sum(axis=1)
    return left + right
