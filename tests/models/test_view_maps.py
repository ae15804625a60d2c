"""What the drawings leave of a density, by hand."""

from dataclasses import replace

import torch

from charnerf.geometry.hull import build_hull
from charnerf.models.view_maps import ViewMaps, kept_share
from charnerf.models.views.mirrored import MirroredSide
from charnerf.types import Hull, SourceViews
from support import helpers

BOX_MIN, BOX_MAX = torch.tensor((-1.8, -1.8, -0.8)), torch.tensor((1.8, 1.8, 2.8))
RADIUS = 0.5
PIXEL = 2 * helpers.HALF_EXTENT / 32


def view_maps(views: SourceViews, hull: Hull | None) -> ViewMaps:
    """Maps of views (V,) with feature maps of 8 x 8, outlines read."""
    return ViewMaps.of(
        views,
        hull,
        torch.arange(len(views.present)),
        map_size=(8, 8),
        box_centre=0.5 * (BOX_MIN + BOX_MAX),
        box_half_extent=1.8,
        sections=False,
        coverage=True,
    )


def maps_of_a_ball(dilation: float = 1.0) -> ViewMaps:
    """Front, side, back and the mirrored side of a ball, as if its hull had been widened by so many pixels."""
    views = MirroredSide()(helpers.source_views(helpers.ball(RADIUS), helpers.source_cameras(size=32)))
    hull = build_hull(views, box_min=BOX_MIN, box_max=BOX_MAX)[0]
    hull = replace(hull, dilations=torch.full_like(hull.dilations, dilation))
    return view_maps(views[0], hull)


def kept(maps: ViewMaps, points: torch.Tensor) -> torch.Tensor:
    return maps.read(points, torch.zeros(len(maps.mirrored) * 64, 1)).kept.clamp_max(1.0)


def test_least_coverage_of_the_views_that_carve_counts_double():
    coverage = torch.tensor(((1.0, 0.5, 0.9, 0.0), (1.0, 0.25, 0.1, 0.0), (0.0, 1.0, 1.0, 1.0)))
    torch.testing.assert_close(
        kept_share(coverage[:, maps_of_a_ball().carving]), torch.tensor((1.0, 0.2, 0.0))
    )


def test_a_ball_ends_between_its_outline_and_a_pixel_outside_of_it():
    inside, outside = RADIUS - 0.1 * PIXEL, RADIUS + 1.1 * PIXEL
    points = torch.tensor(((inside, 0.0, 1.0), (outside, 0.0, 1.0), (0.0, inside, 1.0), (0.0, outside, 1.0)))
    torch.testing.assert_close(kept(maps_of_a_ball(), points), torch.tensor((1.0, 0.0, 1.0, 0.0)))


def test_where_drawings_disagree_outlines_are_as_wide_as_the_hull():
    """Three pixels of dilation instead of one: two pixels more are kept."""
    points = torch.tensor(((RADIUS + 1.5 * PIXEL, 0.0, 1.0), (RADIUS + 3.2 * PIXEL, 0.0, 1.0)))
    torch.testing.assert_close(kept(maps_of_a_ball(3.0), points), torch.tensor((1.0, 0.0)))
    torch.testing.assert_close(kept(maps_of_a_ball(), points), torch.zeros(2))


def test_no_view_speaks_of_what_lies_behind_it():
    cameras = helpers.source_cameras(size=32, orthographic=False)
    views = helpers.source_views(helpers.ball(RADIUS), cameras)
    front_alone = replace(view_maps(views[0], None), carving=torch.tensor([0]))
    behind_the_front_camera = torch.tensor(((0.0, -5.0, 1.0),))
    assert kept(front_alone, behind_the_front_camera).item() == 1.0
