"""Points labelled by the mesh, against figures whose inside is known."""

import numpy as np
import pytest
import torch
import trimesh

from charnerf.data.characters import load_character
from charnerf.data.space import SolidSpace, hull_points, is_inside
from charnerf.errors import DataError
from charnerf.geometry.hull import build_hull, hull_contains
from charnerf.surfaces.raycast import RayCaster
from support import helpers

RADIUS = 0.8
SETTINGS = {"pool_size": 4000, "near_share": 0.5, "spread": 0.03, "num_directions": 64}


def hull_of(character):
    low = torch.tensor((-1.8, -1.8, -0.8))
    return build_hull(character.sources, box_min=low, box_max=low + 3.6, grid_size=64)


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    root = tmp_path_factory.mktemp("ball")
    helpers.write_figure(root, "ball", "train", helpers.ball(RADIUS), views=4)
    return load_character(root, "ball")


def space_of(character, **changes) -> SolidSpace:
    return SolidSpace(character, torch.zeros(0), hull_of(character), **{**SETTINGS, **changes})


def test_labels_of_a_ball_are_right(ball):
    """But for what its triangles cut off the ball, and for points below that a leaning ray passes: none here, it is convex."""
    drawn = space_of(ball).sample(3000, torch.Generator().manual_seed(0))
    distance = helpers.signed_distances(helpers.ball(RADIUS), drawn.points[0])
    facet = 0.02 * RADIUS
    clear = distance.abs() > facet
    assert clear.float().mean() > 0.5 and drawn.inside.shape == (1, 3000)
    assert torch.equal(drawn.inside[0][clear] == 1, distance[clear] < 0)
    assert hull_contains(hull_of(ball)[0], drawn.points[0]).all()


def test_points_beside_the_surface_are_as_far_as_asked(ball):
    drawn = space_of(ball, near_share=1.0).sample(3000, torch.Generator().manual_seed(0))
    distance = helpers.signed_distances(helpers.ball(RADIUS), drawn.points[0])
    assert distance.abs().lt(4 * SETTINGS["spread"]).float().mean() > 0.99
    assert distance.std().item() == pytest.approx(SETTINGS["spread"], rel=0.2)


def test_the_same_seed_draws_the_same_points(ball):
    first, second = (space_of(ball).sample(50, torch.Generator().manual_seed(3)) for _ in range(2))
    assert torch.equal(first.points, second.points) and torch.equal(first.inside, second.inside)


@pytest.mark.parametrize("open_below", [False, True])
def test_a_robe_open_at_the_floor_is_inside(open_below):
    """No camera looks from below: the room under a skirt belongs to the character, whether a lid closes it or not."""
    cone = trimesh.creation.cone(radius=1.0, height=1.0, sections=64)
    if open_below:
        cone.update_faces(cone.triangles_center[:, 2] > 1e-6)
    caster = RayCaster(cone.triangles.astype(np.float32))
    points = np.array(((0.0, 0.0, 0.2), (0.0, 0.0, 1.2), (0.9, 0.0, 0.6), (0.3, 0.3, 0.1)), dtype=np.float32)
    assert is_inside(caster, points, 64).tolist() == [True, False, False, True]


def test_the_room_between_two_walls_is_outside():
    """Armpits, the space between legs: rays escape through a gap, however narrow the sky that is left."""
    walls = [
        trimesh.creation.box((0.1, 2.0, 1.0), trimesh.transformations.translation_matrix((x, 0, 0.5)))
        for x in (-0.3, 0.3)
    ]
    caster = RayCaster(np.concatenate([wall.triangles for wall in walls]).astype(np.float32))
    points = np.array(((0.0, 0.0, 0.1), (0.3, 0.0, 0.1)), dtype=np.float32)
    assert is_inside(caster, points, 64).tolist() == [False, True]


def test_without_a_mesh_the_next_step_is_said(tmp_path):
    helpers.write_figure(tmp_path, "flat", "train", helpers.ball(RADIUS), views=4, mesh=False)
    with pytest.raises(DataError, match=r"found no mesh.*space=silhouettes"):
        space_of(load_character(tmp_path, "flat"))


def test_hull_points_fill_the_hull(ball):
    hull = hull_of(ball)
    points = hull_points(hull, 20000, torch.Generator().manual_seed(0))
    assert hull_contains(hull[0], points).all()
    cells = hull.occupancy[0].nonzero().float()
    centre = (
        hull.box_min[0]
        + (cells.mean(0) + 0.5) * (hull.box_max[0] - hull.box_min[0]) / hull.occupancy.shape[1]
    )
    torch.testing.assert_close(points.mean(0), centre, atol=0.02, rtol=0)
