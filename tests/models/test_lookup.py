"""Pixel-aligned lookup against closed forms and torch's own bilinear interpolation."""

import pytest
import torch
from torch.nn import functional as F

from charnerf.models.lookup import bilinear_rows, maps_to_rows, read_rows


def read(maps: torch.Tensor, pixels: torch.Tensor) -> torch.Tensor:
    """Maps (V, C, h, w) at pixels (P, V, 2) -> (P, V, C)."""
    indices, weights = bilinear_rows(pixels, width=maps.shape[-1], height=maps.shape[-2])
    return read_rows(maps_to_rows(maps), indices, weights).unflatten(0, pixels.shape[:2])


def by_torch(maps: torch.Tensor, pixels: torch.Tensor) -> torch.Tensor:
    """The same by grid_sample."""
    size = pixels.new_tensor((maps.shape[-1], maps.shape[-2]))
    grid = (2.0 * pixels / size - 1.0).transpose(0, 1)[:, None]  # (V, 1, P, 2)
    found = F.grid_sample(maps, grid, mode="bilinear", padding_mode="border", align_corners=False)
    return found[:, :, 0].permute(2, 0, 1)


def test_a_linear_image_is_read_exactly():
    """At pixel centres and everywhere between the first and the last."""
    y, x = torch.meshgrid(torch.arange(5.0) + 0.5, torch.arange(7.0) + 0.5, indexing="ij")
    maps = torch.stack((x, y, 2.0 * x - 3.0 * y + 1.0))[None].double()
    centres = torch.stack((x, y), dim=-1).reshape(-1, 1, 2).double()
    torch.testing.assert_close(read(maps, centres)[:, 0, :2], centres[:, 0], atol=1e-12, rtol=0)
    pixels = 0.5 + torch.rand(200, 1, 2, dtype=torch.float64) * torch.tensor((6.0, 4.0))
    found = read(maps, pixels)[:, 0]
    torch.testing.assert_close(found[:, :2], pixels[:, 0], atol=1e-12, rtol=0)
    expected = 2.0 * pixels[:, 0, 0] - 3.0 * pixels[:, 0, 1] + 1.0
    torch.testing.assert_close(found[:, 2], expected, atol=1e-12, rtol=0)


@pytest.mark.parametrize("size", [(6, 9), (1, 4), (5, 1), (1, 1)])
def test_equal_to_grid_sample_in_value_and_gradient(size):
    maps = torch.randn(3, 2, *size, dtype=torch.float64, requires_grad=True)
    span = torch.tensor((size[1], size[0]), dtype=torch.float64)
    pixels = (
        torch.rand(400, 3, 2, dtype=torch.float64) * 1.6 - 0.3
    ) * span  # a fifth of it beyond the border
    pixels.requires_grad_()
    ours, theirs = read(maps, pixels), by_torch(maps, pixels)
    torch.testing.assert_close(ours, theirs)
    upstream = torch.randn_like(ours)
    for one, other in zip(
        torch.autograd.grad(ours, (maps, pixels), upstream),
        torch.autograd.grad(theirs, (maps, pixels), upstream),
        strict=True,
    ):
        torch.testing.assert_close(one, other)


def test_coordinates_that_are_not_numbers_read_something_finite():
    maps = torch.randn(2, 3, 4, 4, requires_grad=True)
    bad = torch.tensor((torch.nan, torch.inf, -torch.inf, 1e30, -1e30))
    pixels = torch.stack(torch.meshgrid(bad, bad, indexing="ij"), dim=-1).reshape(-1, 1, 2).repeat(1, 2, 1)
    pixels.requires_grad_()
    found = read(maps, pixels)
    gradients = torch.autograd.grad(found.sum(), (maps, pixels))
    assert found.isfinite().all() and all(g.isfinite().all() for g in gradients)


def test_each_view_reads_its_own_map():
    maps = torch.arange(4.0).reshape(4, 1, 1, 1).expand(4, 1, 3, 5)
    found = read(maps, torch.rand(10, 4, 2) * 3.0)
    torch.testing.assert_close(found[..., 0], torch.arange(4.0).expand(10, 4))


def test_weights_sum_to_one_and_linear_maps_commute_with_reading():
    """The reason why a linear layer of the features may be applied to the map before it is read."""
    maps = torch.randn(2, 6, 8, 8, dtype=torch.float64)
    pixels = torch.rand(50, 2, 2, dtype=torch.float64) * 10.0 - 1.0
    indices, weights = bilinear_rows(pixels, width=8, height=8)
    assert (weights >= 0).all() and indices.max() < 128
    torch.testing.assert_close(weights.sum(-1), torch.ones(100, dtype=torch.float64))
    layer = torch.nn.Linear(6, 9, dtype=torch.float64)
    rows = maps_to_rows(maps)
    torch.testing.assert_close(
        read_rows(layer(rows), indices, weights), layer(read_rows(rows, indices, weights))
    )


def test_gradcheck():
    maps = torch.randn(2, 2, 3, 4, dtype=torch.float64, requires_grad=True)
    pixels = (0.6 + 1.8 * torch.rand(5, 2, 2, dtype=torch.float64)).requires_grad_()
    assert torch.autograd.gradcheck(read, (maps, pixels))
