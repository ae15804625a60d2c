"""Pixels that may show a hull: none missed, few too many."""

import pytest
import torch

from charnerf.geometry.cameras import cameras_towards, fibonacci_hemisphere, pixel_centres, pixel_rays
from charnerf.geometry.hull import build_hull, occupied_edges
from charnerf.geometry.silhouettes import hull_silhouettes
from charnerf.types import Hull
from support import helpers

BOX_MIN, BOX_MAX = torch.tensor((-1.8, -1.8, -0.8)), torch.tensor((1.8, 1.8, 2.8))


def hull_of(figure: helpers.Figure) -> Hull:
    views = helpers.source_views(figure, helpers.source_cameras(orthographic=True, size=48))
    return build_hull(views, box_min=BOX_MIN, box_max=BOX_MAX, grid_size=64)[0]


def cameras_around(*, distance: float, orthographic: bool):
    directions = fibonacci_hemisphere(5).float()
    target = torch.tensor(helpers.CENTRE)
    return cameras_towards(
        directions, target=target, distance=distance, half_extent=1.15, size=40, orthographic=orthographic
    )


@pytest.mark.parametrize(("distance", "orthographic"), [(1.7, False), (3.0, False), (4.0, True)])
@pytest.mark.parametrize("figure", [helpers.person(symmetric=False), helpers.ball(0.6)])
def test_every_ray_that_meets_the_hull_is_kept_and_most_others_are_not(figure, distance, orthographic):
    hull = hull_of(figure)
    cameras = cameras_around(distance=distance, orthographic=orthographic)
    found = hull_silhouettes(hull, cameras)
    met = torch.stack(
        [
            occupied_edges(hull, pixel_rays(camera, pixel_centres(40, 40).reshape(-1, 2)), 512)[1]
            .any(-1)
            .reshape(40, 40)
            for camera in (cameras[i] for i in range(len(cameras.focal)))
        ]
    )
    assert not (met & ~found).any()
    assert found.sum() < 1.6 * met.sum()  # a pixel around the outline, at 40 pixels


def test_a_camera_among_the_cells_may_see_the_hull_everywhere():
    hull = hull_of(helpers.ball(0.9))
    inside = cameras_around(distance=1.16, orthographic=False)
    inside = inside[:1]
    inside.world_from_camera[:, :3, 3] = torch.tensor(helpers.CENTRE)
    assert hull_silhouettes(hull, inside).all()


def test_an_empty_hull_is_seen_nowhere():
    hull = hull_of(helpers.ball(0.6))
    empty = Hull(
        torch.zeros_like(hull.occupancy), hull.box_min, hull.box_max, hull.front_depths, hull.edge_distances,
        hull.dilations,
    )  # fmt: skip
    assert not hull_silhouettes(empty, cameras_around(distance=3.0, orthographic=False)).any()
