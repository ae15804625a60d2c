"""Figures cut out by a network of rembg: a real session on a model file of one layer, written here by its format."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import drawing_from_array
from charnerf.drawings.network_mask import NetworkMask
from charnerf.errors import ConfigError, DataError

if find_spec("rembg") is None:  # imported by what is tested alone: it changes settings of the process
    pytest.skip("needs the extra rembg", allow_module_level=True)
SIDE = 320  # of the pictures that u2netp reads


def field(number: int, content: bytes | str | int) -> bytes:
    """A field of a protocol buffer."""
    if isinstance(content, int):
        return varint(number << 3) + varint(content)
    content = content.encode() if isinstance(content, str) else content
    return varint(number << 3 | 2) + varint(len(content)) + content


def varint(value: int) -> bytes:
    low = bytes([value & 127 | (128 if value > 127 else 0)])
    return low + varint(value >> 7) if value > 127 else low


def darkness() -> bytes:
    """ONNX: a 1 x 1 convolution from a picture (1, 3, S, S) to minus the sum of its channels (1, 1, S, S)."""

    def value(name: str, channels: int) -> bytes:
        shape = b"".join(field(1, field(1, size)) for size in (1, channels, SIDE, SIDE))
        return field(1, name) + field(2, field(1, field(1, 1) + field(2, shape)))

    weight = b"".join(field(1, size) for size in (1, 3, 1, 1)) + field(2, 1)
    weight += field(8, "weight") + field(9, np.full(3, -1.0, "<f4").tobytes())
    node = field(1, "picture") + field(1, "weight") + field(2, "mask") + field(4, "Conv")
    graph = field(1, node) + field(2, "darkness") + field(5, weight)
    graph += field(11, value("picture", 3)) + field(12, value("mask", 1))
    return field(1, 8) + field(7, graph) + field(8, field(2, 13))


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("U2NET_HOME", str(tmp_path))
    (tmp_path / "u2netp.onnx").write_bytes(darkness())
    return tmp_path


def test_a_figure_before_a_painted_scene_is_cut_out(models: Path) -> None:
    rows, columns = np.mgrid[:240, :160]
    scene = np.stack((150 + columns // 2, 250 - rows // 3, 200 + 0 * rows), axis=-1)  # no plain paper
    figure = ((rows - 120) / 90.0) ** 2 + ((columns - 80) / 40.0) ** 2 < 1.0
    drawing = drawing_from_array(np.where(figure[..., None], 20, scene).astype(np.uint8), "hero")
    with pytest.raises(DataError, match="plain"):
        cut_out(drawing)
    cutout = cut_out(drawing, NetworkMask("u2netp"))
    assert ((cutout.rgba[..., 3] > 0.5) ^ figure).mean() < 0.01  # the mask is read at another size
    assert "by a network" in cutout.notes[0]


def test_alpha_rules_and_no_network_is_asked(models: Path) -> None:
    rgba = np.zeros((64, 64, 4), np.uint8)
    rgba[8:56, 20:44] = 255
    segment = NetworkMask("u2netp")
    (models / "u2netp.onnx").unlink()
    cutout = cut_out(drawing_from_array(rgba, "hero"), segment)
    assert cutout.notes[0] == "cut out by its alpha"


def test_a_model_that_is_not_there_is_named_and_not_fetched(models: Path) -> None:
    with pytest.raises(ConfigError, match=r"isnet-anime\.onnx.*rembg d isnet-anime"):
        NetworkMask()
    with pytest.raises(ConfigError, match=r"'nonsense', expected one of .*u2netp"):
        NetworkMask("nonsense")
    with pytest.raises(ConfigError, match="withoutbg"):  # asks a server
        NetworkMask("withoutbg")
