"""Views with other numbers of pixels see the same."""

from dataclasses import replace

import torch

from charnerf.geometry.cameras import project
from charnerf.geometry.resizing import resized_cameras, resized_views
from support import helpers


def test_a_resized_camera_sees_the_same():
    points = torch.tensor(helpers.CENTRE) + torch.rand(20, 3) - 0.5
    for camera in (helpers.target_cameras(2, size=16)[0], helpers.source_cameras(size=16)[1]):
        pixels, depth, _ = project(camera, points)
        large, same_depth, _ = project(resized_cameras(camera, 64, 64), points)
        torch.testing.assert_close(large, 4.0 * pixels)
        torch.testing.assert_close(same_depth, depth)


def test_shrunk_views_are_those_drawn_smaller():
    figure = helpers.person(symmetric=False)
    small = helpers.source_views(figure, helpers.source_cameras(size=32))
    found = resized_views(helpers.source_views(figure, helpers.source_cameras(size=64)), 32)
    assert found.cameras.width == found.cameras.height == 32
    torch.testing.assert_close(found.cameras.focal, small.cameras.focal)
    alpha = small.images[:, :, 3:]
    assert (found.images[:, :, 3:] - alpha).abs().mean() < 0.01
    assert ((found.images - small.images)[:, :, :3] * alpha).abs().mean() < 0.01


def test_colors_under_no_alpha_do_not_bleed():
    views = helpers.source_views(helpers.ball(), helpers.source_cameras(size=64))
    alpha = views.images[:, :, 3:]
    red = torch.tensor((1.0, 0.0, 0.0)).view(1, 1, 3, 1, 1).expand_as(views.images[:, :, :3])
    green = torch.tensor((0.0, 1.0, 0.0)).view(1, 1, 3, 1, 1)
    images = torch.cat((torch.where(alpha > 0.0, red, green), alpha), dim=2)
    found = resized_views(replace(views, images=images), 24).images
    seen = (found[:, :, 3] > 0.01).expand(-1, -1, -1, -1)
    assert found[:, :, 1][seen].amax() < 1e-4 and found[:, :, 0][seen].amin() > 0.999
