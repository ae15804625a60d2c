"""Picture files that can not be used are named, with what to do."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import WORKING, drawing_from_array, load_drawing
from charnerf.errors import DataError


def _fails(path, words: str):
    with pytest.raises(DataError, match=words) as caught:
        cut_out(load_drawing(path))
    assert path.name in str(caught.value)


def test_files_that_are_no_pictures(tmp_path):
    _fails(tmp_path / "gone.png", "found nothing, expected a picture")
    _fails(tmp_path, "found a folder")
    (tmp_path / "void.png").write_bytes(b"")
    _fails(tmp_path / "void.png", "empty file of 0 bytes")
    (tmp_path / "words.png").write_text("no picture at all, only words " * 9)
    _fails(tmp_path / "words.png", "a file that is no picture")
    Image.new("RGB", (64, 64)).save(tmp_path / "whole.png")
    whole = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "half.png").write_bytes(whole[: len(whole) // 2])
    _fails(tmp_path / "half.png", "broken picture")


def test_a_huge_picture_is_refused_before_it_is_decoded(tmp_path):
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 6, 0, 0, 0)
    path = tmp_path / "huge.png"
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")
    )
    _fails(path, "found 60000 x 60000 pixels, expected at most 200 million")


def test_pictures_without_a_figure(tmp_path):
    Image.new("RGBA", (200, 300), (255, 0, 0, 0)).save(tmp_path / "clear.png")
    _fails(tmp_path / "clear.png", "fully transparent")
    Image.new("RGB", (200, 300), (250, 250, 250)).save(tmp_path / "blank.png")
    _fails(tmp_path / "blank.png", "found a figure of 0.00 %")
    Image.new("RGB", (10, 10)).save(tmp_path / "tiny.png")
    _fails(tmp_path / "tiny.png", "expected at least 16 a side")
    noise = np.random.default_rng(0).integers(0, 255, (120, 90, 3), np.uint8)
    Image.fromarray(noise).save(tmp_path / "busy.png")
    _fails(tmp_path / "busy.png", "expected a plain background")


def test_modes_of_pictures_read_the_same(tmp_path):
    """Palette, grey, 16 bit and CMYK pictures of one black disc on white."""
    y, x = np.mgrid[0:80, 0:60]
    grey = np.where(np.hypot(x - 30, y - 40) < 20, 0, 255).astype(np.uint8)
    rgb = Image.fromarray(grey).convert("RGB")
    rgb.save(tmp_path / "rgb.png")
    expected = load_drawing(tmp_path / "rgb.png").rgba
    Image.fromarray(grey).save(tmp_path / "grey.png")
    rgb.convert("P").save(tmp_path / "palette.png")
    Image.fromarray(grey.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    rgb.convert("CMYK").save(tmp_path / "print.tif")
    Image.fromarray(grey.astype(np.float32) / 255).save(tmp_path / "floats.tif")
    for name in ("grey.png", "palette.png", "deep.png", "print.tif", "floats.tif"):
        np.testing.assert_allclose(load_drawing(tmp_path / name).rgba, expected, atol=2 / 255)


def test_pixels_that_are_not_finite_are_refused(tmp_path):
    values = np.ones((40, 30), np.float32)
    values[20, 10] = np.nan
    Image.fromarray(values).save(tmp_path / "holes.tif")
    _fails(tmp_path / "holes.tif", "no finite numbers")


def test_a_turned_photograph_is_turned_back(tmp_path):
    picture = Image.new("RGB", (60, 40), "white")
    picture.paste("red", (0, 0, 10, 10))
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was turned
    picture.save(tmp_path / "turned.jpg", exif=exif, quality=95)
    rgba = load_drawing(tmp_path / "turned.jpg").rgba
    assert rgba.shape[:2] == (60, 40)
    assert rgba[3, -4, 1] < 0.2 and rgba[3, 3, 1] > 0.8


def test_large_pictures_are_reduced_at_once(tmp_path):
    Image.new("RGBA", (4000, 1000), (10, 20, 30, 255)).save(tmp_path / "wide.png")
    drawing = load_drawing(tmp_path / "wide.png")
    assert drawing.rgba.shape == (WORKING // 4, WORKING, 4) and drawing.size == (4000, 1000)


def test_arrays_are_checked():
    with pytest.raises(DataError, match=r"front: found an array of shape \(5, 5\)"):
        drawing_from_array(np.zeros((5, 5)), "front")
    with pytest.raises(DataError, match=r"outside of \[0, 1\]"):
        drawing_from_array(np.full((50, 50, 3), 2.0), "front")
    whole = drawing_from_array(np.full((50, 50, 3), 255, np.uint8), "front")
    assert whole.rgba.shape == (50, 50, 4) and (whole.rgba == 1.0).all()
