"""Runs of hulls known in closed form."""

import torch

from charnerf.geometry.cross_sections import cross_sections, read_cross_sections
from charnerf.geometry.hull import build_hull
from charnerf.types import Hull
from support import helpers


def hull_of(occupancy: torch.Tensor) -> Hull:
    side = occupancy.shape[0]
    nothing = torch.zeros(1, 4, 4)
    return Hull(occupancy, torch.zeros(3), torch.full((3,), side / 32.0), nothing, nothing, torch.zeros(1))


def test_places_in_a_box_and_beside_it():
    """A box of 0.5 x 0.25 x 1 m in cells of 1/32 m: places are linear between the ends of each run."""
    occupancy = torch.zeros(64, 64, 64, dtype=torch.bool)
    occupancy[8:24, 16:24, 0:32] = True
    sections = cross_sections(hull_of(occupancy))
    points = torch.tensor(((0.5, 0.625, 0.5), (0.375, 0.6875, 0.25), (0.77, 0.7, 0.9), (1.9, 1.9, 1.9)))
    places, halves = read_cross_sections(sections, points)
    torch.testing.assert_close(places[0], torch.zeros(3), atol=1e-5, rtol=0)
    torch.testing.assert_close(halves[0], torch.tensor((0.25, 0.125, 0.5)))
    torch.testing.assert_close(places[1], torch.tensor((-0.5, 0.5, -0.5)), atol=1e-5, rtol=0)
    assert (places[2].abs() <= 2.0).all() and places[2, 0] > 1.0  # beside the box
    torch.testing.assert_close(torch.cat((places[3], halves[3])), torch.zeros(6))


def test_two_legs_have_runs_of_their_own():
    occupancy = torch.zeros(64, 64, 64, dtype=torch.bool)
    occupancy[8:16, 24:40] = True
    occupancy[40:56, 24:40] = True
    sections = cross_sections(hull_of(occupancy))
    _, halves = read_cross_sections(sections, torch.tensor(((0.375, 1.0, 1.0), (1.5, 1.0, 1.0))))
    torch.testing.assert_close(halves[:, 0], torch.tensor((0.125, 0.25)))


def test_a_ball_fills_its_hull_up_to_the_ellipse():
    """The hull of a ball from front, side and back is two cylinders' intersection; in every level section the ball is a disc in a
    square, so that the squares of the places along x and y sum to 1 on its surface."""
    views = helpers.source_views(helpers.ball(), helpers.source_cameras(size=256))
    box = torch.tensor((-1.8, -1.8, -0.8)), torch.tensor((1.8, 1.8, 2.8))
    hull = build_hull(views, box_min=box[0], box_max=box[1], grid_size=128)[0]
    points = helpers.surface_points(helpers.ball(), 3000).float()
    places, halves = read_cross_sections(cross_sections(hull), points)
    wide = halves[:, 0] > 0.15
    sums = places[wide, 0] ** 2 + places[wide, 1] ** 2
    assert 0.8 < float(sums.mean()) < 1.05  # the hull is dilated by a pixel
    assert float(sums.std()) < 0.2
