"""f2, the MLP stage after the views are combined, and how directions are encoded (paper, Fig. network)."""

from typing import final

from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.geometry.encoding import positional_encoding
from charnerf.models.mlp import residual_blocks

DIRECTION_FREQUENCIES = 2
DIRECTION_RANGE = 0.5  # eq. 1 has period 2: directions are halved so that opposite ones do not share a code


def encode_directions(view_dirs: Tensor) -> Tensor:
    """Encode directions (..., 3) by eq. 1 as (..., 12)."""
    return positional_encoding(DIRECTION_RANGE * view_dirs, DIRECTION_FREQUENCIES)


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
