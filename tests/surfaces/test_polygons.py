import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from charnerf.errors import DataError
from charnerf.surfaces.polygons import triangulate
from support.polygon_files import LETTER_C


def area_vectors(points, triangles):
    first, second, third = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * np.cross(second - first, third - first)


@pytest.mark.parametrize("turn", [(0, 0, 0), (90, 0, 0), (0, 90, 0), (180, 0, 0), (20, 50, 70)])
@pytest.mark.parametrize("first", range(8))
def test_concave_polygons_keep_their_openings(turn, first):
    """Whichever way they lie, wind, and wherever they begin: triangles do not overlap and face as the polygon does."""
    points = np.roll(np.array([(x, y, 0.0) for x, y in LETTER_C]), first, axis=0)
    points = points @ Rotation.from_euler("xyz", turn, degrees=True).as_matrix().T + (3, 4, 5)
    for polygon in (np.arange(8), np.arange(8)[::-1]):
        (triangles,) = triangulate(points, [polygon])
        vectors = area_vectors(points, polygon[triangles])
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).sum(), 5.0)
        np.testing.assert_allclose(np.linalg.norm(vectors.sum(axis=0)), 5.0)
        winding = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0) * (1 if polygon[0] == 0 else -1)
        assert vectors.sum(axis=0) @ winding > 0.0


def test_convex_polygons_become_fans():
    angles = np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False)
    points = np.stack((np.cos(angles), np.sin(angles), np.zeros(5)), axis=-1)
    quad, pentagon, triangle = triangulate(points, [np.arange(4), np.arange(5), np.array((4, 0, 2))])
    np.testing.assert_array_equal(quad, ((0, 1, 2), (2, 3, 0)))
    np.testing.assert_array_equal(pentagon, ((0, 1, 2), (0, 2, 3), (0, 3, 4)))
    np.testing.assert_array_equal(triangle, ((0, 1, 2),))


def test_a_dart_is_cut_where_it_is_hollow():
    points = np.array(((0, 0, 0), (2, 1, 0), (0, 2, 0), (1, 1, 0)), float)
    for first in range(4):
        polygon = np.roll(np.arange(4), first)
        (triangles,) = triangulate(points, [polygon])
        np.testing.assert_allclose(
            np.linalg.norm(area_vectors(points, polygon[triangles]), axis=1).sum(), 1.0
        )


def test_polygons_of_no_area_do_no_harm():
    points = np.array(((0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 0, 0), (0, 0, 0)), float)
    (triangles,) = triangulate(points, [np.arange(5)])
    assert triangles.shape[1] == 3 and triangles.max() < 5


def test_a_polygon_of_a_million_corners_is_refused():
    with pytest.raises(DataError, match="a face has 1000000 corners, expected at most 10000"):
        triangulate(np.zeros((3, 3)), [np.tile(np.arange(2), 500_000)])
