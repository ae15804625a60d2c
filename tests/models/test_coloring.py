"""Colours of places without a network: values one after the other give what rows of points give."""

import pytest
import torch

from charnerf.geometry.cameras import project_into_all
from charnerf.models.coloring import DrawnColoring
from charnerf.models.heads.blend import BlendHead
from charnerf.models.heads.radiance import RadianceHead
from charnerf.models.view_maps import Pictures
from support import helpers


@pytest.mark.parametrize("orthographic", [True, False])
@pytest.mark.parametrize(("head", "num_values"), [(BlendHead, 3 + 4), (RadianceHead, 3)])
def test_colors_are_those_of_the_heads_rule_and_of_the_drawings_where_points_project(
    head, num_values, orthographic
):
    generator = torch.Generator().manual_seed(0)
    cameras = helpers.source_cameras(size=16, orthographic=orthographic)[0:3]
    pictures = Pictures.of(torch.rand(3, 3, 24, 24, generator=generator), 24)
    points = 3.0 * torch.rand(50, 3, generator=generator) - torch.tensor((1.5, 1.5, 0.5))  # beyond them too
    appearance = 4.0 * torch.randn(num_values, 2, 50, generator=generator)
    coloring = DrawnColoring(head, cameras, pictures, None, pictures)
    pixels, _, _ = project_into_all(cameras, points)
    drawn = pictures.read(pixels / 16.0)
    rows = [head.rgb_of(one.t(), drawn).t() for one in appearance.unbind(1)]
    found = coloring.rgb_of(points, appearance)
    torch.testing.assert_close(found, torch.stack(rows, dim=1), atol=1e-5, rtol=0)
    torch.testing.assert_close(coloring.rgb_of(points, appearance[:, 1]), found[:, 1])
    assert float(found.std(-1).min()) > 0.05
