"""pixelNeRF's encoder: ResNet-34 up to its third stage, all maps enlarged to the first one's size and concatenated."""

import logging
import urllib.error
import urllib.request
from typing import Any, final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.errors import DependencyError
from charnerf.models.encoders.base import AbstractEncoder

STEM, STAGES = 64, (64, 128, 256)
BLOCKS = (3, 4, 6)
PATIENCE = 5.0  # seconds to wait for the place that weights come from


@final
class ResNet34(AbstractEncoder):
    """ResNet-34 with BatchNorm on the drawing on white; its sizes are the same at any scale.

    Args:
        pretrained: Name of weights on the Hugging Face hub that a training begins with, where they are on this machine or
            can be had; None for a random start.

    Raises:
        DependencyError: If `transformers` is missing.

    Source: pixelNeRF (Yu 2021): stem and three stages, 64 + 64 + 128 + 256 channels at half the drawing's size, pictures
    in [-1, 1], first max-pool kept.
    """

    def __init__(self, *, pretrained: str | None) -> None:
        super().__init__()
        self.pretrained = pretrained
        self.backbone: nn.Module = _resnet()
        self.out_channels = STEM + sum(STAGES)
        self.multiple = 16

    def forward(self, images: Tensor) -> Tensor:
        """Map images (N, 4, H, W), of which alpha is not read, to feature maps (N, 512, H / 2, W / 2)."""
        embedder: Any = self.backbone.embedder
        encoder: Any = self.backbone.encoder
        first = embedder.embedder(images[:, :3])
        maps, x = [first], embedder.pooler(first)
        for stage in encoder.stages:
            x = stage(x)
            maps.append(F.interpolate(x, size=first.shape[-2:], mode="bilinear", align_corners=True))
        return torch.cat(maps, dim=1)

    def begin(self) -> str:
        """Take the pretrained weights where they can be had, and say which start this is."""
        if self.pretrained is None:
            return "encoder: ResNet-34 begins with random weights, as encoder.pretrained=null asks for."
        state, why = _pretrained_state(self.pretrained)
        if state is None:
            return (
                f"encoder: ResNet-34 begins with random weights, not with {self.pretrained}: {why}. pixelNeRF begins with"
                " weights trained on ImageNet."
            )
        own = self.backbone.state_dict()
        self.backbone.load_state_dict({name: state[name] for name in own})
        return f"encoder: ResNet-34 begins with the pretrained weights {self.pretrained}."


def _resnet() -> nn.Module:
    """The network without its last stage and classifier, random weights."""
    try:
        from transformers import ResNetConfig, ResNetModel
    except ImportError as error:
        raise DependencyError(
            "encoder=resnet34: found no package transformers, expected it for pixelNeRF's encoder; install it by"
            " `pip install 'charnerf[pixelnerf]'`, or take encoder=double."
        ) from error
    return ResNetModel(
        ResNetConfig(embedding_size=STEM, hidden_sizes=list(STAGES), depths=list(BLOCKS), layer_type="basic")
    )


def _pretrained_state(name: str) -> tuple[dict[str, Tensor] | None, str]:
    """Weights of a whole ResNet-34 by name, from this machine or the hub; or None and why."""
    from huggingface_hub import constants
    from transformers import ResNetModel
    from transformers.utils import logging as its_logging

    its_logging.set_verbosity_error()
    logging.getLogger("huggingface_hub").setLevel(logging.ERROR)
    for is_local in (True, False):
        if not is_local and (constants.HF_HUB_OFFLINE or not _answers(constants.ENDPOINT)):
            break
        try:
            return ResNetModel.from_pretrained(name, local_files_only=is_local).state_dict(), ""
        except (OSError, ValueError):
            continue
    return None, f"they are not on this machine and {constants.ENDPOINT} does not give them"


def _answers(address: str) -> bool:
    """Whether a server answers at all; the hub's own client would try for half a minute."""
    try:
        urllib.request.urlopen(urllib.request.Request(address, method="HEAD"), timeout=PATIENCE).close()
    except urllib.error.HTTPError:
        return True
    except (OSError, ValueError):
        return False
    return True
