"""Levels of detail of a sphere, whose figures are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from charnerf.errors import DataError
from charnerf.meshing.distance import surface_chamfer_mm
from charnerf.meshing.lod import build_lods, lod_report, lod_table, named, num_parts
from charnerf.meshing.options import MeshOptions
from support.analytic_scenes import scene_of, sphere


def _ball(radius: float, detail: int = 4) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(detail, radius)


def test_distance_of_equal_surfaces_is_nought_and_of_concentric_balls_their_gap():
    assert surface_chamfer_mm(_ball(1.0), _ball(1.0)) < 0.01
    assert surface_chamfer_mm(_ball(1.0), _ball(0.99)) == pytest.approx(10.0, rel=0.03)


def test_a_large_triangle_is_as_near_as_many_small_ones():
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    fine = box.subdivide().subdivide().subdivide()
    assert surface_chamfer_mm(box, fine) < 0.01


def test_parts_are_counted():
    two = trimesh.util.concatenate([_ball(1.0, 1), _ball(0.1, 1).apply_translation((3, 0, 0))])
    assert num_parts(two) == 2


@pytest.fixture(scope="module")
def lods():
    options = MeshOptions(num_cameras=1)
    return build_lods(scene_of(sphere, width=0.1), None, options, resolutions=(32, 48), faces=(500, 1500))


def test_levels_of_a_sphere_have_the_figures_of_a_sphere(lods):
    rows = [lod.row() for lod in lods]
    assert [(row["grid"], row["faces_asked"]) for row in rows] == [
        (48, None),
        (32, None),
        (48, 1500),
        (48, 500),
    ]
    for row, lod in zip(rows, lods, strict=True):
        assert (row["parts"], row["watertight"], row["euler_number"]) == (1, True, 2)
        assert row["vertices"] - row["faces"] // 2 == 2
        np.testing.assert_allclose(lod.built.mesh.bounds[:, 2], (0.0, 2.0), atol=1e-9)
    assert rows[0]["chamfer_mm"] == 0.0
    # a sphere in n equal triangles lies about a half of the area of one triangle inside of itself
    flat = 1000.0 * 4.0 * math.pi / rows[3]["faces"] / (4.0 * math.sqrt(3.0))
    assert 0.1 * flat < rows[3]["chamfer_mm"] < 2.5 * flat
    assert rows[1]["chamfer_mm"] < 4.0 and rows[2]["chamfer_mm"] < rows[3]["chamfer_mm"]
    assert 0.0 < rows[0]["evaluated"] < 1.0 and rows[2]["evaluated"] is None


def test_the_table_names_files_and_the_papers_values(lods):
    files = named(lods, "ball")
    assert list(files) == ["ball_LOD0", "ball_LOD_grid32", "ball_LOD1", "ball_LOD2"]
    table = lod_table(files)
    assert len(table.splitlines()) == 2 + 4
    assert len({line.count("|") for line in table.splitlines()}) == 1
    scene = scene_of(sphere, width=0.1)
    grid = build_lods(scene, None, MeshOptions(num_cameras=1), resolutions=(64,))
    assert "| 1822, 3640, 2 |" in lod_report(named(grid, "ball"))


def test_numbers_go_to_levels_that_are_coarser_and_farther_off_than_the_one_before(lods):
    finest, coarse_grid, decimated, least = lods
    worse = replace(coarse_grid, chamfer_mm=decimated.chamfer_mm + 1.0)  # though it has more faces
    names = named((finest, worse, decimated, least), "ball")
    assert list(names) == ["ball_LOD0", "ball_LOD_grid32", "ball_LOD1", "ball_LOD2"]


def test_no_grid_is_an_error():
    with pytest.raises(DataError, match="found no grid"):
        build_lods(scene_of(sphere), None, MeshOptions(), resolutions=())
