"""Shapes without meaning: what holds for every seed."""

import numpy as np
import pytest
import trimesh

from charnerf.geometry.stances import ARM_POSES, draw_stance
from charnerf.procedural import make_shape
from charnerf.procedural.assembly import REACH
from charnerf.procedural.booleans import united
from charnerf.procedural.solids import KINDS, Solid, make_solid

RED, BLUE = np.array((1.0, 0.0, 0.0)), np.array((0.0, 0.0, 1.0))


def mesh_of(vertices, faces):
    return trimesh.Trimesh(vertices, faces, process=False)


def box(half, color):
    mesh = trimesh.creation.box(2.0 * np.asarray(half))
    return Solid(np.asarray(mesh.vertices), np.asarray(mesh.faces), np.tile(color, (8, 1)))


@pytest.mark.parametrize("kind", dict.fromkeys(KINDS), ids=lambda kind: kind.__name__)
def test_solids_are_closed_turned_outwards_and_fill_the_cube(kind):
    for seed in range(4):
        solid = make_solid(np.random.default_rng(seed), [RED, BLUE], kind)
        mesh = mesh_of(solid.vertices, solid.faces)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0.05
        np.testing.assert_allclose(mesh.bounds, [[-1.0] * 3, [1.0] * 3], atol=1e-12)
        assert solid.colors.min() >= 0.0 and solid.colors.max() <= 1.0
        assert mesh_of(solid.mirrored().vertices, solid.mirrored().faces).volume == pytest.approx(mesh.volume)


def test_a_cut_takes_away_what_the_cutter_holds_and_shows_its_colour():
    """A cube of side 2 less a column of side 1 through it: 8 - 2 m^3; a cube inside of it adds nothing."""
    whole = united([box((1, 1, 1), RED), box((0.5, 0.5, 0.5), RED)], [box((0.5, 0.5, 2.0), BLUE)])
    mesh = mesh_of(whole.vertices, whole.faces)
    mesh.merge_vertices()
    assert mesh.is_watertight and mesh.volume == pytest.approx(6.0, abs=1e-5)
    on_column = np.abs(whole.vertices[:, :2]).max(axis=1) < 0.6
    blue = np.all(np.isclose(whole.colors, BLUE), axis=1)
    assert blue.any() and (blue <= on_column).all()


def test_cuts_that_part_or_swallow_a_piece_are_left_out():
    for half in ((2.0, 2.0, 2.0), (2.0, 2.0, 0.2)):
        whole = united([box((1, 1, 1), RED)], [box(half, BLUE)])
        assert mesh_of(whole.vertices, whole.faces).volume == pytest.approx(8.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_shape_stands_where_characters_do(seed):
    surface = make_shape(seed)
    points = surface.triangles.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    assert low[2] == pytest.approx(0.0, abs=1e-6) and high[2] == pytest.approx(2.0, abs=1e-6)
    np.testing.assert_allclose(low[:2] + high[:2], 0.0, atol=1e-6)
    assert high[:2].max() <= REACH + 1e-6
    assert np.isfinite(surface.colors).all() and surface.colors.min() >= 0.0 and surface.colors.max() <= 1.0
    again = make_shape(seed)
    assert np.array_equal(surface.triangles, again.triangles)
    assert np.array_equal(surface.colors, again.colors)


def test_no_two_seeds_make_the_same_shape():
    assert len({make_shape(seed).triangles.tobytes() for seed in range(5)}) == 5


def test_stances_come_in_the_shares_of_the_table():
    rng = np.random.default_rng(0)
    stances = [draw_stance(rng) for _ in range(4000)]
    assert sum(pose[0] for pose in ARM_POSES.values()) == pytest.approx(1.0)
    for name, (share, down, _, _) in ARM_POSES.items():
        if name in ("T", "down"):  # the ranges of the others overlap
            left = np.mean([down[0] <= stance.arms[0].down <= down[1] for stance in stances])
            assert left >= share - 0.03, name
    uneven = np.mean([abs(stance.arms[0].down - stance.arms[1].down) > 12.0 for stance in stances])
    assert 0.05 < uneven < 0.2
    assert 0.4 < np.mean([stance.legs[0].out > 4.0 for stance in stances]) < 0.5
