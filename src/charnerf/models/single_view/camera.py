"""f1 of pixelNeRF: coordinates turned into each source camera; the encoder's features enter before every block."""

import math
from typing import final

import torch
from torch import Tensor, nn

from charnerf.geometry.encoding import positional_encoding
from charnerf.models.inputs import FieldInputs
from charnerf.models.mlp import residual_blocks
from charnerf.models.single_view.base import AbstractSingleView


@final
class CameraSingleView(AbstractSingleView):
    """Point and raw direction in the axes of each source camera, and a linear map of the features for every block.

    The point is turned, not moved, into the camera's axes, and encoded with the point itself included: sines and cosines of
    factor 2^k x, k = 0 .. octaves - 1.

    Args:
        width: D.
        num_point_features: Further inputs per view.
        num_blocks: Residual blocks.
        octaves: Of the point's code.
        factor: Lowest frequency, radians a half-extent of the box.

    Source: pixelNeRF (Yu 2021): six octaves, factor 1.5, three blocks before the views' mean.
    """

    def __init__(
        self, *, width: int, num_point_features: int, num_blocks: int, octaves: int, factor: float
    ) -> None:
        super().__init__()
        self.octaves = octaves
        self.factor = factor
        self.latent_size = width * max(1, num_blocks)
        self.from_points = nn.Linear(3 + 2 * 3 * octaves + 3, width)
        self.from_point_features = (
            nn.Linear(num_point_features, width, bias=False) if num_point_features else None
        )
        self.blocks = residual_blocks(width=width, num_blocks=num_blocks)

    def encode(self, points: Tensor, rotations: Tensor) -> Tensor:
        """Code (P, V, C) of points (P, 3) in the axes (V, 3, 3) of each camera, the points themselves first."""
        turned = _turned(points, rotations)
        code = positional_encoding(turned * (self.factor / math.pi), self.octaves)
        return torch.cat((turned, code), dim=-1)

    def forward(self, inputs: FieldInputs, point_features: Tensor, view_dirs: Tensor) -> Tensor:
        """V^(i) (P, V, D)."""
        code = self.encode(inputs.box_points, inputs.rotations)
        directions = _turned(view_dirs, inputs.rotations).expand(len(code), -1, -1)
        x = self.from_points(torch.cat((code, directions), dim=-1))
        if self.from_point_features is not None:
            x = x + self.from_point_features(point_features)
        latents = inputs.latents.unflatten(-1, (-1, x.shape[-1])).unbind(-2)
        if len(self.blocks) == 0:
            return x + latents[0]
        for block, latent in zip(self.blocks, latents, strict=True):
            x = block(x + latent)
        return x


def _turned(vectors: Tensor, rotations: Tensor) -> Tensor:
    """World vectors (P, 3) in the axes (V, 3, 3) of each camera, (P, V, 3)."""
    return (vectors[:, None, :, None] * rotations).sum(-2)  # transposed: world to camera
