"""Squares of rays by AlexNet's features: the metric's distance, with gradients that stay finite."""

import pytest
import torch
from torch import Tensor

from charnerf.evaluation.lpips import Lpips
from charnerf.losses.alex_lpips import AlexLpips
from charnerf.losses.perceptual import Perceptual
from charnerf.types import RenderOutput
from support.batches import small_batch

SIDE = 32


def rays(rgb: Tensor) -> RenderOutput:
    return RenderOutput(rgb=rgb, opacity=rgb[..., 0], depth=rgb[..., 0])


def value(rgb: Tensor, truth: Tensor, side: int = SIDE) -> Tensor:
    return Perceptual(weight=1.0).values(rays(rgb), None, small_batch(rgb=truth, square=side))["perceptual"]


def test_it_is_the_metric_of_each_characters_square_and_of_nothing_else():
    """Two characters; seven rays more each, which look elsewhere."""
    shown, truth = torch.rand(2, SIDE * SIDE + 7, 3), torch.rand(2, SIDE * SIDE + 7, 3)
    metric = Lpips()
    pictures = [one[:, : SIDE * SIDE].reshape(2, SIDE, SIDE, 3) for one in (shown, truth)]
    expected = [metric(a, b)["lpips"] for a, b in zip(*pictures, strict=True)]
    assert value(shown, truth).item() == pytest.approx(sum(expected) / 2, rel=1e-5)
    elsewhere = torch.cat((shown[:, :-7], 1.0 - shown[:, -7:]), dim=1)
    torch.testing.assert_close(value(elsewhere, truth), value(shown, truth))


@pytest.mark.parametrize("color", (0.0, 0.5, 1.0))
def test_its_gradient_is_finite_where_pictures_are_plain_and_equal(color):
    truth = torch.full((1, SIDE * SIDE, 3), color)
    shown = truth.clone().requires_grad_()
    loss = value(shown, truth)
    loss.backward()
    assert loss.item() == 0.0 and shown.grad.isfinite().all()


def test_its_gradient_is_finite_where_no_feature_answers():
    network = AlexLpips()
    network.conv0_weight.zero_()
    network.conv0_bias.fill_(-1.0)
    shown = torch.rand(1, 3, SIDE, SIDE, requires_grad=True)
    network(shown, torch.rand(1, 3, SIDE, SIDE)).sum().backward()
    assert shown.grad.isfinite().all()


def test_its_gradient_is_that_of_finite_differences():
    torch.manual_seed(1)
    shown, truth = torch.rand(1, SIDE * SIDE, 3, requires_grad=True), torch.rand(1, SIDE * SIDE, 3)
    value(shown, truth).backward()
    direction = torch.randn_like(truth)
    with torch.no_grad():
        step = 1e-3 * direction
        difference = (value(shown + step, truth) - value(shown - step, truth)) / 2e-3
    assert (shown.grad * direction).sum().item() == pytest.approx(difference.item(), rel=0.05)


def test_a_softened_edge_is_farther_off_than_its_squared_error_says():
    """An edge two pixels off, and one blurred as to have the same squared error: this prefers the sharp one."""
    columns = torch.arange(SIDE, dtype=torch.float32).expand(SIDE, SIDE).reshape(1, -1, 1)
    truth, moved = (columns < 16).float().expand(-1, -1, 3), (columns < 18).float().expand(-1, -1, 3)
    widths = torch.linspace(0.5, 12.0, 400)
    blurred = [((16.0 - columns - 0.5) / width).sigmoid().expand(-1, -1, 3) for width in widths]
    errors = torch.stack([(one - truth).square().mean() for one in blurred])
    alike = blurred[int((errors - (moved - truth).square().mean()).abs().argmin())]
    assert value(moved, truth) < 0.8 * value(alike, truth)


def test_without_a_square_it_has_no_value():
    one = torch.rand(1, 2, 3)
    assert Perceptual(weight=1.0).values(rays(one), None, small_batch(rgb=one)) == {}
