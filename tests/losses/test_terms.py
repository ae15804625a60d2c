"""Loss terms by hand."""

import pytest
import torch

from charnerf.losses.terms import (
    absolute_alpha_error,
    absolute_depth_error,
    balanced_occupancy_error,
    squared_color_error,
    squared_opacity_error,
)


def test_squared_color_error_sums_channels_and_averages_rays():
    rgb = torch.tensor((((0.0, 0.5, 1.0), (0.2, 0.2, 0.2)),))
    target = torch.tensor((((0.5, 0.5, 0.0), (0.2, 0.1, 0.2)),))
    torch.testing.assert_close(squared_color_error(rgb, target), torch.tensor((1.25 + 0.01) / 2))


def test_absolute_alpha_error():
    alphas = torch.tensor(((1.0, 0.25), (0.5, 0.75)))
    torch.testing.assert_close(absolute_alpha_error(alphas, torch.ones(())), torch.tensor(1.5 / 4))


def test_squared_opacity_error():
    opacity, alpha = torch.tensor((1.0, 0.5, 0.25)), torch.tensor((1.0, 0.0, 0.75))
    torch.testing.assert_close(squared_opacity_error(opacity, alpha), torch.tensor(0.5 / 3))


def test_absolute_depth_error_counts_rays_that_meet_the_surface():
    """Each weighs by its opacity, which gets no gradient by it."""
    depth, target = torch.tensor((3.0, 9.0, 4.5, 1.0)), torch.tensor((2.5, 0.0, 5.0, 0.0))
    opacity = torch.tensor((1.0, 0.3, 0.5, 0.9), requires_grad=True)
    error = absolute_depth_error(depth.requires_grad_(), target, opacity)
    torch.testing.assert_close(error, torch.tensor((0.5 + 0.25) / 2))
    error.backward()
    assert opacity.grad is None and depth.grad.tolist() == [0.5, 0.0, -0.25, 0.0]
    assert absolute_depth_error(depth, torch.zeros(4), opacity) == 0


def test_balanced_occupancy_error_weighs_both_labels_the_same():
    alphas, inside = torch.tensor((0.5, 1.0, 0.0, 0.1, 0.2)), torch.tensor((1.0, 1.0, 1.0, 0.0, 0.0))
    expected = 0.5 * ((0.25 + 0.0 + 1.0) / 3 + (0.01 + 0.04) / 2)
    torch.testing.assert_close(balanced_occupancy_error(alphas, inside), torch.tensor(expected))
    torch.testing.assert_close(balanced_occupancy_error(alphas[:3], inside[:3]), torch.tensor(0.5 * 1.25 / 3))
    assert balanced_occupancy_error(inside, inside) == 0


@pytest.mark.parametrize("shape", [(5,), (2, 3)])
def test_gradcheck(shape):
    values = lambda *more: torch.rand(*shape, *more, dtype=torch.float64)  # noqa: E731
    rgb, alpha = values(3).requires_grad_(), values().requires_grad_()
    target, other = values(3), values() + 2.0
    flags = torch.arange(alpha.numel()).reshape(shape) % 2
    assert torch.autograd.gradcheck(lambda x: squared_color_error(x, target), (rgb,))
    assert torch.autograd.gradcheck(lambda x: absolute_alpha_error(x, other), (alpha,))
    assert torch.autograd.gradcheck(lambda x: squared_opacity_error(x, other), (alpha,))
    assert torch.autograd.gradcheck(lambda x: absolute_depth_error(x, other, 0.5 * other), (alpha,))
    assert torch.autograd.gradcheck(lambda x: balanced_occupancy_error(x, flags.double()), (alpha,))
