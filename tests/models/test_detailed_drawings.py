"""Colours from drawings finer than those that are encoded."""

from dataclasses import replace
from functools import cache

import pytest
import torch

from charnerf.errors import ShapeError
from charnerf.geometry.resizing import resized_views
from charnerf.meshing.symmetry import symmetric_scene
from charnerf.types import SourceViews
from support import helpers, tiny_models

SMALL, LARGE = 32, 128


@cache
def striped(size: int) -> SourceViews:
    """A ball's drawings with stripes one pixel of 128 wide; at 32 they are grey."""
    views = helpers.source_views(helpers.ball(), helpers.source_cameras(size=size))
    fine = (torch.arange(LARGE) % 2).float().view(-1, LARGE // size).mean(1)
    alpha = views.images[:, :, 3:]
    rgb = fine.expand_as(views.images[:, :, :3])
    return replace(views, images=torch.cat((rgb, alpha), dim=2))


@pytest.fixture(scope="module")
def model():
    return tiny_models.shake(tiny_models.tiny_model(views="mirrored", features="image_hull_section"))


def points_of_stripes() -> torch.Tensor:
    """Points in the ball at centres of the front drawing's pixels of 128."""
    pixel = 2.0 * helpers.HALF_EXTENT / LARGE
    across = (torch.arange(-12, 12) + 0.5) * pixel
    return torch.stack((across, torch.full_like(across, -0.5), torch.full_like(across, 1.0)), dim=1)


def test_colors_follow_the_finer_drawings_and_densities_do_not_change(model):
    points = points_of_stripes()
    dirs = torch.tensor((0.0, 1.0, 0.0)).expand_as(points)
    with torch.no_grad():
        scene = model.scene(model.encode(striped(SMALL), detailed=striped(LARGE)), 0)
        plain = model.scene(model.encode(striped(SMALL)), 0).field(points, dirs)
        coarse, fine = (scene.at_width(width).field(points, dirs) for width in (SMALL, LARGE))
        halfway = scene.at_width(LARGE // 2).field(points, dirs)
    assert torch.equal(coarse.rgb, plain.rgb) and torch.equal(scene.field(points, dirs).rgb, plain.rgb)
    assert torch.equal(fine.densities, plain.densities)
    contrast = [answer.rgb.diff(dim=0).abs().mean().item() for answer in (plain, halfway, fine)]
    assert contrast[2] > 10.0 * contrast[0] and contrast[1] < 0.5 * contrast[2]


def test_some_points_are_colored_as_they_are_among_all(model):
    """Densities first, finer colours for every third point: the same numbers as all at once."""
    points = points_of_stripes()
    dirs = torch.tensor((0.0, 1.0, 0.0)).expand_as(points)
    with torch.no_grad():
        scene = model.scene(model.encode(striped(SMALL), detailed=striped(LARGE)), 0).at_width(LARGE)
        at_once = scene.field(points, dirs)
        answer = scene.field.densities(points, dirs)
        some = scene.field.colors(answer.state[::3])
    torch.testing.assert_close(answer.densities, at_once.densities)
    torch.testing.assert_close(some, at_once.rgb[::3])


def test_wider_than_the_drawings_is_as_wide_as_they_are(model):
    points = points_of_stripes()
    dirs = torch.tensor((0.0, 1.0, 0.0)).expand_as(points)
    with torch.no_grad():
        scene = model.scene(model.encode(striped(SMALL), detailed=striped(LARGE)), 0)
        assert torch.equal(
            scene.at_width(LARGE).field(points, dirs).rgb, scene.at_width(9999).field(points, dirs).rgb
        )


def test_a_symmetric_scene_keeps_the_finer_drawings(model):
    with torch.no_grad():
        scene = symmetric_scene(model.scene(model.encode(striped(SMALL), detailed=striped(LARGE)), 0))
        points = points_of_stripes()
        dirs = torch.tensor((0.0, 1.0, 0.0)).expand_as(points)
        fine, plain = scene.at_width(LARGE).field(points, dirs), scene.field(points, dirs)
    assert fine.rgb.diff(dim=0).abs().mean() > 5.0 * plain.rgb.diff(dim=0).abs().mean()


def test_other_views_are_no_detail_of_these(model):
    with pytest.raises(ShapeError, match="same views"):
        model.encode(striped(SMALL), detailed=striped(LARGE)[:, :2])


def test_views_of_any_size_are_encoded_as_the_model_was_trained_and_colored_as_given(model):
    large = striped(LARGE)
    small = model.fitted(large)
    assert small.cameras.width == SMALL and model.fitted(small) is small
    points = points_of_stripes()
    dirs = torch.tensor((0.0, 1.0, 0.0)).expand_as(points)
    with torch.no_grad():
        found = model.scene(model.encode(large), 0).field(points, dirs)
        expected = model.scene(model.encode(small, detailed=large), 0).at_width(LARGE).field(points, dirs)
        enlarged = model.encode(resized_views(small, LARGE // 8))
    assert torch.equal(found.rgb, expected.rgb)
    assert torch.equal(model.carve(large).occupancy, model.carve(small).occupancy)
    assert enlarged.views.cameras.width == SMALL and enlarged.detailed is None
