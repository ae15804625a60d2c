"""Perceptual distance of pictures by AlexNet's features, with gradients."""

from importlib.resources import files
from typing import final

import torch
from safetensors.torch import load
from torch import Tensor, nn
from torch.nn import functional as F

_SHIFT, _SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)  # of inputs in [-1, 1]: ImageNet's means
_STRIDES, _PADDINGS, _POOLED = (4, 1, 1, 1, 1), (2, 2, 1, 1, 1), (False, True, True, False, False)
LEAST_SIDE = 31  # pixels: of smaller pictures the last maps have no pixel


@final
class AlexLpips(nn.Module):
    """LPIPS v0.1 with AlexNet: its five convolutions, and a weight for every channel of each.

    The weights lie in the package in half precision, which moves distances by less than 0.0005.

    Source: Zhang 2018 (The Unreasonable Effectiveness of Deep Features as a Perceptual Metric).
    """

    shift: Tensor
    scale: Tensor

    def __init__(self) -> None:
        super().__init__()
        tensors = load(files("charnerf").joinpath("weights/lpips_alexnet.safetensors").read_bytes())
        for name, tensor in tensors.items():
            self.register_buffer(name.replace(".", "_"), tensor.float())
        self.register_buffer("shift", torch.tensor(_SHIFT)[:, None, None])
        self.register_buffer("scale", torch.tensor(_SCALE)[:, None, None])

    def forward(self, pictures: Tensor, truth: Tensor) -> Tensor:
        """Distances (N,) of pictures (N, 3, H, W) from one (1, 3, H, W), in [0, 1], LEAST_SIDE a side or more."""
        x = (2.0 * torch.cat((pictures, truth)) - 1.0 - self.shift) / self.scale
        total = x.new_zeros(len(pictures))
        for index, (stride, padding, is_pooled) in enumerate(zip(_STRIDES, _PADDINGS, _POOLED, strict=True)):
            if is_pooled:
                x = F.max_pool2d(x, 3, stride=2)
            weight, bias = getattr(self, f"conv{index}_weight"), getattr(self, f"conv{index}_bias")
            x = F.conv2d(x, weight, bias, stride=stride, padding=padding).relu()
            unit = x / (x.square().sum(1, keepdim=True).sqrt() + 1e-10)
            squared = (unit[:-1] - unit[-1:]).square()
            head = getattr(self, f"head{index}_weight")[:, None, None]
            total = total + (squared * head).sum(1).mean((-1, -2))
        return total
