"""Hulls of figures known in closed form: nothing is cut away, and what is left explains the drawings."""

import logging
from dataclasses import replace
from functools import cache

import pytest
import torch

from charnerf.errors import DataError
from charnerf.geometry import hull as hull_module
from charnerf.geometry.cameras import pixel_centres, pixel_rays, project_into_all, world_axis_along
from charnerf.geometry.hull import build_hull, hull_contains, occupied_edges
from charnerf.types import Hull, RayBundle, SourceViews
from support import helpers

BOX_MIN, BOX_MAX = torch.tensor((-1.8, -1.8, -0.8)), torch.tensor((1.8, 1.8, 2.8))
FIGURES = {
    "lefty": helpers.person(symmetric=False),
    "ball": helpers.ball(),
    "dumbbell": helpers.dumbbell(),
}


def carve(views: SourceViews, **settings) -> Hull:
    """Hulls in the model's box."""
    return build_hull(views, box_min=BOX_MIN, box_max=BOX_MAX, **settings)


@cache
def views_of(figure: helpers.Figure, *, orthographic: bool = True, size: int = 32) -> SourceViews:
    return helpers.source_views(figure, helpers.source_cameras(orthographic=orthographic, size=size))


@pytest.mark.parametrize("grid_size", [32, 64])
@pytest.mark.parametrize("orthographic", [True, False])
@pytest.mark.parametrize("name", FIGURES)
def test_no_surface_is_cut_away(name, orthographic, grid_size):
    hull = carve(views_of(FIGURES[name], orthographic=orthographic), grid_size=grid_size)[0]
    points = helpers.surface_points(FIGURES[name], 4000).float()
    assert hull_contains(hull, points).all()


@pytest.mark.parametrize("size", [24, 64])
def test_no_surface_is_cut_away_at_any_size_of_drawing(size):
    hull = carve(views_of(FIGURES["lefty"], size=size), grid_size=128)[0]
    assert hull_contains(hull, helpers.surface_points(FIGURES["lefty"], 4000).float()).all()


@pytest.mark.parametrize("orthographic", [True, False])
def test_the_hull_is_tight(orthographic):
    """Every occupied cell touches, within its own size and the dilation, every silhouette."""
    views = views_of(FIGURES["dumbbell"], orthographic=orthographic, size=64)
    hull = carve(views, grid_size=64)[0]
    index = hull.occupancy.nonzero()
    cell = (hull.box_max - hull.box_min) / 64
    pixels, depth, _ = project_into_all(views.cameras[0], hull.box_min + (index + 0.5) * cell)
    for view in range(3):
        mask = views.images[0, view, 3] > hull_module.MASK_ALPHA
        shown = pixel_centres(64, 64)[mask]
        distance = torch.cdist(pixels[:, view], shown).amin(-1)
        scale = views.cameras.focal[0, view, 0] / (1.0 if orthographic else depth[:, view])
        assert (distance <= 0.5 * cell.norm() * scale * 1.02 + 1.0 + 2**0.5).all()
    assert hull.occupancy.float().mean() < 0.4


@pytest.mark.parametrize("pinholes", [(), (1,), (0, 1, 2)], ids=["layers", "both", "coarse to fine"])
def test_layers_and_coarse_to_fine_are_the_same_as_testing_all_cells(pinholes):
    drawn = [views_of(FIGURES["lefty"], orthographic=view not in pinholes)[0] for view in range(3)]
    outside = torch.stack(
        [hull_module._distance_to(one.images[view, 3] > 0.05) for view, one in enumerate(drawn)]
    )
    parts = {
        name: torch.stack([getattr(one.cameras, name)[view] for view, one in enumerate(drawn)])
        for name in ("world_from_camera", "focal", "principal_point", "orthographic")
    }
    cameras = replace(drawn[0].cameras, **parts)
    low, high = torch.tensor((-0.8, -0.5, -0.1)), torch.tensor((0.9, 0.5, 2.1))
    dilations = torch.ones(3)
    found = hull_module._occupancy(outside, cameras, dilations, low, high, 128)
    axis = torch.arange(128)
    index = torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), dim=-1).reshape(-1, 3)
    cell = (high - low) / 128
    touched = hull_module._may_touch(
        outside, cameras, dilations, low + (index + 0.5) * cell, 0.5 * cell.norm()
    )
    assert torch.equal(found, touched.reshape(128, 128, 128))
    assert 0.01 < found.float().mean() < 0.5


def test_the_hull_in_double_precision_is_the_same():
    views = views_of(FIGURES["lefty"])
    single = build_hull(views, box_min=BOX_MIN, box_max=BOX_MAX)
    double = build_hull(views.to(torch.float64), box_min=BOX_MIN.double(), box_max=BOX_MAX.double())
    assert double.front_depths.dtype == torch.float64
    assert (single.occupancy == double.occupancy).float().mean() > 0.9999


def test_a_camera_within_the_box_is_no_layer():
    """What lies behind it is not known to be empty."""
    views = views_of(FIGURES["lefty"])[0]
    camera = views.cameras[:1]
    low, high = BOX_MIN, BOX_MAX
    assert world_axis_along(camera[0], torch.stack((low, high))) == 1
    within = torch.tensor((-1.8, -5.0, -0.8))
    assert world_axis_along(camera[0], torch.stack((within, high))) is None


@pytest.mark.parametrize("orthographic", [True, False])
@pytest.mark.parametrize("name", FIGURES)
def test_the_hull_explains_the_drawings(name, orthographic):
    """Seen from the drawings' cameras it covers 99.5 % of each mask, and little beyond the dilation."""
    views = views_of(FIGURES[name], orthographic=orthographic)
    hull = carve(views, grid_size=64)[0]
    assert torch.equal(hull.dilations, torch.ones(3))
    for view in range(3):
        rays = pixel_rays(views.cameras[0, view], pixel_centres(32, 32).reshape(-1, 2))
        _, occupied = occupied_edges(hull, rays, 256)
        seen = occupied.any(-1).reshape(32, 32)
        mask = views.images[0, view, 3] > 0.05
        assert seen[mask].float().mean() >= 0.995
        grown = torch.nn.functional.max_pool2d(mask[None].float(), 7, 1, 3)[0] > 0
        assert not (seen & ~grown).any()


def test_disagreeing_drawings_widen_the_hull_and_say_so(caplog):
    """The side drawing is five pixels lower than the others: an intersection would cut the head off."""
    views = views_of(FIGURES["lefty"], size=64)
    images = views.images.clone()
    images[:, 1] = images[:, 1].roll(5, dims=-2)
    with caplog.at_level(logging.WARNING):
        hull = carve(replace(views, images=images), grid_size=64)[0]
    assert (hull.dilations > 1.0).all()
    assert "Drawings disagree" in caplog.text and "source views" in caplog.text
    camera = views.cameras[0, 0]
    y, x = (images[0, 0, 3] > 0.05).nonzero().unbind(-1)
    _, occupied = occupied_edges(hull, pixel_rays(camera, torch.stack((x + 0.5, y + 0.5), dim=-1)), 256)
    assert occupied.any(-1).float().mean() >= 0.995
    caplog.clear()
    carve(views, grid_size=64)
    assert caplog.text == ""


def test_drawings_of_different_characters_are_refused():
    views = views_of(FIGURES["ball"], size=64)
    images = torch.zeros_like(views.images)
    images[0, 0, 3, :2] = 1.0
    images[0, 1, 3, 62:] = 1.0
    images[0, 2, 3, :2] = 1.0
    with pytest.raises(
        DataError, match=r"source views \[0, 1, 2\].*disagree by more than 32 pixels.*another order.*align"
    ):
        carve(replace(views, images=images), grid_size=64)


def test_a_figure_wider_than_the_box_is_told_as_such():
    """Its drawings agree; it is the space looked at that is too narrow."""
    box_min, box_max = torch.tensor((-0.3, -0.3, -0.8)), torch.tensor((0.3, 0.3, 2.8))
    with pytest.raises(DataError, match=r"within 0\.3 m of its axis.*model\.box_half_extent"):
        build_hull(views_of(FIGURES["lefty"], size=64), box_min=box_min, box_max=box_max, grid_size=64)


def test_an_empty_silhouette_is_refused_with_its_view():
    views = views_of(FIGURES["ball"])
    images = views.images.clone()
    images[0, 1] = 0.0
    with pytest.raises(DataError, match="source view 1: found an empty silhouette"):
        carve(replace(views, images=images), grid_size=32)


def test_mirrored_and_absent_views_carve_nothing():
    views = views_of(FIGURES["dumbbell"])
    images = views.images.clone()
    images[0, 1] = 0.0  # would be refused, or carve everything away
    for field in ("mirrored", "present"):
        flags = getattr(views, field).clone()
        flags[0, 1] = field == "mirrored"
        hull = carve(replace(views, images=images, **{field: flags}), grid_size=64)[0]
        without = carve(views[:, torch.tensor((0, 2))], grid_size=64)[0]
        assert torch.equal(hull.occupancy, without.occupancy)


def test_maps_say_depth_to_the_front_and_distance_to_the_edge():
    """Of a ball of radius 0.8 m: front at 4 - 0.8 m from the middle pixel; the edge 0.8 m from it."""
    hull = carve(views_of(FIGURES["ball"], size=64), grid_size=128)[0]
    pixel = 2 * helpers.HALF_EXTENT / 64
    assert hull.front_depths[0, 32, 32].item() == pytest.approx(3.2, abs=2.5 * pixel)
    assert hull.front_depths[0, 0, 0].item() == pytest.approx(4.0, abs=2 * pixel)  # misses: the box's centre
    assert hull.edge_distances[0, 32, 32].item() == pytest.approx(0.8 / pixel, abs=1.5)
    corner = (2**0.5 * helpers.HALF_EXTENT - 0.8) / pixel
    assert hull.edge_distances[0, 0, 0].item() == pytest.approx(-corner, abs=1.5)
    assert hull.front_depths.isfinite().all() and hull.edge_distances.isfinite().all()


def test_hull_contains_and_occupied_edges_by_hand():
    occupancy = torch.zeros(4, 4, 4, dtype=torch.bool)
    occupancy[1, 2, 3] = occupancy[3, 2, 3] = True
    maps = torch.zeros(1, 2, 2)
    hull = Hull(
        occupancy, torch.tensor((-2.0, -2.0, 0.0)), torch.tensor((2.0, 2.0, 8.0)), maps, maps, maps[0]
    )
    points = torch.tensor(
        (
            (-0.5, 0.5, 7.0),
            (0.5, 0.5, 7.0),
            (1.5, 0.5, 7.9),
            (1.5, 0.5, 8.1),
            (1.5, 2.5, 7.0),
            (-3.0, 0.5, 7.0),
        )
    )
    assert hull_contains(hull, points).tolist() == [True, False, True, False, False, False]
    rays = RayBundle(
        torch.tensor(((-3.0, 0.5, 7.0), (-3.0, 5.0, 7.0))), torch.tensor(((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    )
    t_edges, occupied = occupied_edges(hull, rays, 4)
    torch.testing.assert_close(t_edges[0], torch.tensor((1.0, 2.0, 3.0, 4.0, 5.0)))
    assert occupied.tolist() == [[False, True, False, True], [False] * 4]


def test_occupied_edges_agree_with_containment():
    hull = carve(views_of(FIGURES["lefty"]), grid_size=64)[0]
    rays = pixel_rays(helpers.target_cameras(4)[2], pixel_centres(32, 32).reshape(-1, 2))
    t_edges, occupied = occupied_edges(hull, rays, 100)
    middle = 0.5 * (t_edges[:, 1:] + t_edges[:, :-1])
    points = rays.origins[:, None] + middle[..., None] * rays.directions[:, None]
    differ = occupied != hull_contains(hull, points)
    assert differ.float().mean() < 1e-3  # midpoints on a cell's face round either way


def test_batches_of_characters_are_carved_one_by_one():
    both = [views_of(FIGURES[name]) for name in ("ball", "dumbbell")]
    batch = SourceViews(
        images=torch.cat([v.images for v in both]),
        cameras=both[0].cameras[[0, 0]],
        present=torch.cat([v.present for v in both]),
        mirrored=torch.cat([v.mirrored for v in both]),
    )
    together = carve(batch, grid_size=32)
    for index, views in enumerate(both):
        alone = carve(views, grid_size=32)
        for name in ("occupancy", "box_min", "box_max", "front_depths", "edge_distances", "dilations"):
            assert torch.equal(getattr(together, name)[index], getattr(alone, name)[0])


def test_a_view_that_only_colors_carves_nothing():
    """With a back widened to everything the hull is that of front and side; the maps of its own outline stay."""
    views = views_of(FIGURES["lefty"])
    widened = views.carving_alphas.clone()
    widened[:, 2] = 1.0
    found = carve(replace(views, widened_alphas=widened), grid_size=64)
    assert torch.equal(found.occupancy, carve(views[:, :2], grid_size=64).occupancy)
    assert torch.equal(found.edge_distances, carve(views, grid_size=64).edge_distances)


def test_rows_are_widened_where_drawings_disagree_and_nowhere_else():
    """A back that lacks an arm loses it; widened in the arm's rows alone, what was lost comes back and no other row changes."""
    views = views_of(FIGURES["lefty"], size=64)
    images = views.images.clone()
    agreed = carve(views, grid_size=64)[0]
    rows = (views.images[0, 0, 3] > 0.5).sum(-1)
    arms = rows > rows.max() // 2
    images[0, 2, 3, arms, 40:] = 0.0
    images[0, 2, 3, arms, :24] = 0.0
    lacking = replace(views, images=images)
    widened = lacking.carving_alphas.clone()
    widened[0, 2, arms] = 1.0
    settings = {"grid_size": 64, "coverage": 0.0}
    cut, kept = carve(lacking, **settings)[0], carve(replace(lacking, widened_alphas=widened), **settings)[0]
    points = helpers.surface_points(FIGURES["lefty"], 4000).float()
    assert not hull_contains(cut, points).all() and hull_contains(kept, points).all()
    below = points[points[:, 2] < 0.8]
    assert torch.equal(hull_contains(kept, below), hull_contains(agreed, below))
    assert (kept.dilations == 1.0).all(), "no silhouette is widened as a whole beside that"
