"""Colours on white, bytes and PNG files."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from charnerf.pictures import bytes_on_white, images_on_white, on_white, read_bilinear, save_png, to_bytes

PIXELS = [[0.2, 0.4, 0.6, 1.0], [0.2, 0.4, 0.6, 0.5], [0.2, 0.4, 0.6, 0.0]]
SHOWN = [[0.2, 0.4, 0.6], [0.6, 0.7, 0.8], [1.0, 1.0, 1.0]]


def test_opaque_half_and_clear_pixels_on_white() -> None:
    assert on_white(torch.tensor(PIXELS)).numpy() == pytest.approx(np.array(SHOWN))
    assert on_white(np.array(PIXELS)) == pytest.approx(np.array(SHOWN))


def test_channels_first_is_the_same() -> None:
    images = torch.rand(2, 4, 5, 3, generator=torch.Generator().manual_seed(0))
    torch.testing.assert_close(images_on_white(images).movedim(1, -1), on_white(images.movedim(1, -1)))


def test_bytes_on_white_round_to_the_nearest() -> None:
    rgba = np.array([[10, 20, 30, 255], [0, 0, 0, 128], [7, 7, 7, 0]], np.uint8)
    assert bytes_on_white(rgba).tolist() == [[10, 20, 30], [127, 127, 127], [255, 255, 255]]


def test_numbers_as_bytes_are_rounded_and_clamped() -> None:
    values = [-0.1, 0.0, 0.5 / 255 + 1e-6, 0.5, 1.0, 1.2]
    assert to_bytes(np.array(values)).tolist() == [0, 0, 1, 128, 255, 255]
    assert to_bytes(torch.tensor(values, requires_grad=True)).tolist() == [0, 0, 1, 128, 255, 255]


def test_a_picture_comes_back_from_its_file(tmp_path: Path) -> None:
    pixels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    save_png(tmp_path / "folder" / "a.png", Image.fromarray(pixels))
    with Image.open(tmp_path / "folder" / "a.png") as opened:
        assert (np.asarray(opened) == pixels).all()


def test_a_picture_is_read_exactly_where_it_is_linear_and_its_edge_holds_beyond() -> None:
    y, x = np.mgrid[:4, :5] + 0.5  # values at pixel centres are their positions
    picture = np.stack((x, y), axis=-1)
    inside = np.array([[0.5, 0.5], [2.2, 3.1], [4.5, 1.75]])
    np.testing.assert_allclose(read_bilinear(picture, inside), inside, atol=1e-12)
    np.testing.assert_allclose(
        read_bilinear(picture, np.array([[-3.0, 9.0], [0.1, 2.0]])), [[0.5, 3.5], [0.5, 2.0]]
    )
