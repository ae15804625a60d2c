"""Encoders: sizes, gradients, memory layouts, and what `double` is made of."""

import pytest
import torch
from torch.nn import functional as F

from charnerf.models.encoders.hourglass import StackedHourglass, group_norm
from support import tiny_models

ENCODERS = {
    "single": tiny_models.single,
    "single, stride 1": lambda: tiny_models.single(stride=1),
    "single, stride 4, 2 stacks": lambda: tiny_models.single(stride=4, num_stacks=2),
    "double": tiny_models.double,
}


@pytest.mark.parametrize("name", ENCODERS)
def test_sizes(name):
    """Sides are divided by the stride; `multiple` is the smallest side, and any multiple of it works."""
    encoder = ENCODERS[name]()
    stride = {"single, stride 1": 1, "single, stride 4, 2 stacks": 4}.get(name, 2)
    for height, width in ((1, 1), (2, 3)):
        images = torch.randn(2, 4, height * encoder.multiple, width * encoder.multiple)
        maps = encoder(images)
        expected = (2, encoder.out_channels, images.shape[2] // stride, images.shape[3] // stride)
        assert maps.shape == expected and maps.isfinite().all()


@pytest.mark.parametrize("name", ENCODERS)
def test_every_parameter_gets_a_gradient(name):
    encoder = ENCODERS[name]()
    encoder(torch.randn(2, 4, 2 * encoder.multiple, 2 * encoder.multiple)).square().sum().backward()
    silent = [n for n, p in encoder.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0]
    assert silent == []


@pytest.mark.parametrize("name", ENCODERS)
def test_channels_last_is_the_same(name):
    encoder = ENCODERS[name]().double()
    images = torch.randn(2, 4, 2 * encoder.multiple, 2 * encoder.multiple, dtype=torch.float64)
    expected = encoder(images)
    last = encoder.to(memory_format=torch.channels_last)
    torch.testing.assert_close(last(images.contiguous(memory_format=torch.channels_last)), expected)


@pytest.mark.parametrize("name", ENCODERS)
def test_each_drawing_is_encoded_by_itself(name):
    encoder = ENCODERS[name]().double()
    images = torch.randn(3, 4, 2 * encoder.multiple, 2 * encoder.multiple, dtype=torch.float64)
    torch.testing.assert_close(encoder(images)[1:2], encoder(images[1:2]))


def test_double_is_the_coarse_map_enlarged_beside_the_fine_one():
    encoder = tiny_models.double()
    images = torch.randn(1, 4, 16, 16)
    coarse = encoder.coarse(F.avg_pool2d(images, 2))
    assert coarse.shape == (1, 5, 4, 4)
    maps = encoder(images)
    torch.testing.assert_close(
        maps[:, :5], F.interpolate(coarse, size=(8, 8), mode="bilinear", align_corners=False)
    )
    torch.testing.assert_close(maps[:, 5:], encoder.fine(images))
    assert encoder.out_channels == 11


def test_feature_maps_stay_aligned_with_the_drawing():
    """Where a drawing changes, the map changes around the same share of its side (one pixel of slack)."""
    encoder = StackedHourglass(
        in_channels=1, num_stacks=1, depth=1, width=8, out_channels=8, stride=2
    ).double()
    size = 64
    images = torch.rand(1, 1, size, size, dtype=torch.float64)
    maps = encoder(images)
    for x, y in ((8, 40), (50, 20)):
        changed = images.clone()
        changed[0, 0, y : y + 2, x : x + 2] += 0.5
        difference = (encoder(changed) - maps).abs().sum(1)[0]
        row, column = divmod(int(difference.argmax()), size // 2)
        assert abs(column + 0.5 - (x + 1) / 2) <= 1.5 and abs(row + 0.5 - (y + 1) / 2) <= 1.5


@pytest.mark.parametrize("channels", [1, 4, 8, 12, 16, 32, 48, 64, 256, 512])
def test_group_norm_divides_the_channels(channels):
    norm = group_norm(channels)
    assert channels % norm.num_groups == 0 and norm.num_groups <= 32
    assert channels // norm.num_groups >= min(8, channels)
