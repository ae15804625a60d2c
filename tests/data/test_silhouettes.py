"""Points labelled by silhouettes, against a figure whose inside is known."""

from dataclasses import replace

import pytest
import torch

from charnerf.data.silhouettes import SilhouetteSpace
from charnerf.data.store import CharacterStore, OpenCharacter
from charnerf.geometry.hull import build_hull, hull_contains
from support import helpers

RADIUS = 0.8


@pytest.fixture(scope="module")
def ball(tmp_path_factory) -> OpenCharacter:
    """A ball in 24 pictures."""
    root = tmp_path_factory.mktemp("ball")
    helpers.write_figure(root, "ball", "train", helpers.ball(RADIUS), views=24, mesh=False)
    low = torch.tensor((-1.8, -1.8, -0.8))
    carve = lambda views: build_hull(views, box_min=low, box_max=low + 3.6, grid_size=64)  # noqa: E731
    return CharacterStore(root=root, names=("ball",), carve=carve, memory_mib=64).open("ball")


def labelled(one: OpenCharacter, num_points: int, seed: int) -> tuple[torch.Tensor, torch.Tensor]:
    space = SilhouetteSpace(one.character, one.images, one.hull)
    drawn = space.sample(num_points, torch.Generator().manual_seed(seed))
    return drawn.points[0], drawn.inside[0]


def test_labels_are_right(ball):
    """Right to the precision of a pixel, inside to that of 24 silhouettes from above."""
    points, labels = labelled(ball, 4000, 0)
    distance = helpers.signed_distances(helpers.ball(RADIUS), points)
    pixel = 2 * helpers.HALF_EXTENT / helpers.SIZE
    assert distance[labels == 0].min() > -0.4 * pixel  # a tenth of such a pixel may be covered
    assert (distance[labels == 0] > 0).float().mean() > 0.98
    above = points[:, 2] > 1.0  # no picture looks from below, where the hull of silhouettes is wider
    assert distance[(labels == 1) & above].max() < 2 * pixel
    assert (distance[labels == 1] < 0).float().mean() > 0.95
    assert set(labels.tolist()) == {0.0, 1.0} and hull_contains(ball.hull[0], points).all()


@pytest.mark.parametrize("num_points", [1, 2, 7, 100])
def test_both_labels_come_evenly(ball, num_points):
    points, labels = labelled(ball, num_points, 1)
    assert points.shape == (num_points, 3) and labels.shape == (num_points,)
    if num_points == 100:
        assert 40 <= labels.sum() <= 60


def test_points_go_all_through_the_ball(ball):
    points, labels = labelled(ball, 4000, 2)
    inside = points[labels == 1] - torch.tensor(helpers.CENTRE)
    torch.testing.assert_close(inside.mean(0), torch.zeros(3), atol=0.06, rtol=0)
    assert (inside.norm(dim=-1) < 0.5 * RADIUS).float().mean().item() == pytest.approx(0.125, abs=0.04)


def test_a_character_that_fills_its_hull_gets_one_label(ball):
    """No empty space to be found: every point is inside, and there are still as many as asked for."""
    occupancy = torch.zeros_like(ball.hull.occupancy)
    occupancy[:, 30:34, 30:34, 30:34] = True
    full = replace(ball, hull=replace(ball.hull, occupancy=occupancy))
    points, labels = labelled(full, 50, 3)
    assert len(points) == 50 and labels.eq(1).all()
