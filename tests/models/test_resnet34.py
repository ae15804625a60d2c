"""pixelNeRF's encoder."""

import sys

import pytest
import torch

pytest.importorskip("transformers", reason="the extra charnerf[pixelnerf] is not installed")

from charnerf.errors import DependencyError
from charnerf.models.encoders import resnet34


@pytest.fixture(scope="module")
def encoder() -> resnet34.ResNet34:
    torch.manual_seed(0)
    return resnet34.ResNet34(pretrained="someone/resnet-34").eval()


def test_it_is_resnet34_without_its_last_stage(encoder):
    """Convolutions 1 + 2 (3 + 4 + 6) and two shortcuts; 64 + 64 + 128 + 256 channels at half size; alpha is not read."""
    convolutions = [one for one in encoder.modules() if isinstance(one, torch.nn.Conv2d)]
    assert len(convolutions) == 1 + 2 * 13 + 2
    images = torch.randn(2, 4, 32, 48)
    maps = encoder(images)
    assert maps.shape == (2, 512, 16, 24) and encoder.out_channels == 512
    changed = images.clone()
    changed[:, 3] = 0.0
    assert torch.equal(encoder(changed), maps)
    torch.testing.assert_close(encoder(images)[1:], encoder(images[1:]), rtol=1e-4, atol=1e-5)
    assert sum(p.numel() for p in encoder.parameters()) == 8_170_304


def test_every_weight_learns(encoder):
    encoder.train()(torch.randn(2, 4, 32, 32)).square().sum().backward()
    assert [n for n, p in encoder.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0] == []
    encoder.eval()


def test_where_it_begins_is_said(encoder, monkeypatch):
    other = resnet34.ResNet34(pretrained=None)
    assert "random weights, as encoder.pretrained=null asks" in other.begin()
    state = {name: tensor + 1 for name, tensor in encoder.backbone.state_dict().items()} | {
        "more": torch.ones(1)
    }
    monkeypatch.setattr(resnet34, "_pretrained_state", lambda name: (state, ""))
    other.pretrained = "someone/resnet-34"
    assert other.begin() == "encoder: ResNet-34 begins with the pretrained weights someone/resnet-34."
    assert torch.equal(other.backbone.state_dict()["embedder.embedder.convolution.weight"],
                       state["embedder.embedder.convolution.weight"])  # fmt: skip


def test_without_a_hub_it_begins_at_random(encoder, monkeypatch, tmp_path):
    monkeypatch.setattr(resnet34, "_answers", lambda address: False)
    text = encoder.begin()
    assert "random weights, not with someone/resnet-34: they are not on this machine" in text


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(DependencyError, match=r"pip install 'charnerf\[pixelnerf\]'"):
        resnet34.ResNet34(pretrained=None)
