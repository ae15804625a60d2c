"""f1 and f2: the MLP stages before and after the views are combined (paper, Fig. network)."""

from typing import final

from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.geometry.encoding import positional_encoding
from charnerf.models.inputs import PointInputs
from charnerf.models.mlp import residual_blocks

DIRECTION_FREQUENCIES = 2
DIRECTION_RANGE = 0.5  # eq. 1 has period 2: directions are halved so that opposite ones do not share a code


def encode_directions(view_dirs: Tensor) -> Tensor:
    """Encode directions (..., 3) by eq. 1 as (..., 12)."""
    return positional_encoding(DIRECTION_RANGE * view_dirs, DIRECTION_FREQUENCIES)


@final
class SingleView(nn.Module):
    """f1: encoder features, encoded point and direction through a linear layer each, summed, then residual blocks per view.

    Args:
        width: D.
        encoded_size: Size of the encoded point.
        num_extras: Further inputs per view.
        num_blocks: Residual blocks (paper: 3).
    """

    def __init__(self, *, width: int, encoded_size: int, num_extras: int, num_blocks: int) -> None:
        super().__init__()
        self.from_points = nn.Linear(encoded_size + 6 * DIRECTION_FREQUENCIES, width)
        self.from_extras = nn.Linear(num_extras, width, bias=False) if num_extras else None
        self.blocks = residual_blocks(width=width, num_blocks=num_blocks)

    def forward(self, inputs: PointInputs, view_dirs: Tensor) -> Tensor:
        """V^(i) (P, V, D) of points seen along view_dirs (P, 3), or (1, 3) for all."""
        size = inputs.encoded_points.shape[-1]
        weight = self.from_points.weight
        # one direction for all points costs one row, not one a point
        located = F.linear(inputs.encoded_points, weight[:, :size]) + F.linear(
            encode_directions(view_dirs), weight[:, size:], self.from_points.bias
        )
        x = inputs.latents + located[:, None]
        return self.blocks(x if self.from_extras is None else x.add_(self.from_extras(inputs.extras)))


@final
class MultiView(nn.Module):
    """f2 up to its outputs: the direction enters again, then residual blocks, and one linear layer gives the raw density.

    Args:
        width: D.
        num_blocks: Residual blocks.
    """

    def __init__(self, *, width: int, num_blocks: int) -> None:
        super().__init__()
        self.from_dirs = nn.Linear(6 * DIRECTION_FREQUENCIES, width)
        self.blocks = residual_blocks(width=width, num_blocks=num_blocks)
        self.density = nn.Linear(width, 1)

    def forward(self, fused: Tensor, view_dirs: Tensor) -> tuple[Tensor, Tensor]:
        """Features (P, D) and raw densities (P,) of fused features (P, D)."""
        features = self.blocks(fused + self.from_dirs(encode_directions(view_dirs)))
        return features, self.density(F.relu(features))[:, 0]
