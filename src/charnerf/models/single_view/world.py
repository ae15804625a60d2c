"""f1 of the paper: world coordinates by eq. 1; the encoder's features enter once."""

from typing import final

from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.geometry.encoding import positional_encoding
from charnerf.models.fused import linear_of_columns
from charnerf.models.inputs import FieldInputs
from charnerf.models.mlp import residual_blocks
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.stages import DIRECTION_FREQUENCIES, encode_directions


@final
class WorldSingleView(AbstractSingleView):
    """Encoder features, encoded point and direction through a linear layer each, summed, then residual blocks per view.

    Args:
        width: D.
        num_frequencies: nu of eq. 1.
        num_point_features: Further inputs per view.
        num_blocks: Residual blocks (paper: 3).

    Source: paper, Fig. network.
    """

    def __init__(self, *, width: int, num_frequencies: int, num_point_features: int, num_blocks: int) -> None:
        super().__init__()
        self.num_frequencies = num_frequencies
        self.latent_size = width
        self.from_points = nn.Linear(2 * 3 * num_frequencies + 6 * DIRECTION_FREQUENCIES, width)
        self.from_point_features = (
            nn.Linear(num_point_features, width, bias=False) if num_point_features else None
        )
        self.blocks = residual_blocks(width=width, num_blocks=num_blocks)

    def forward(self, inputs: FieldInputs, point_features: Tensor, view_dirs: Tensor) -> Tensor:
        """V^(i) (P, V, D)."""
        code = positional_encoding(inputs.box_points, self.num_frequencies)
        size = code.shape[-1]
        weight = self.from_points.weight
        # one direction for all points costs one row, not one a point
        located = F.linear(code, weight[:, :size]) + F.linear(
            encode_directions(view_dirs), weight[:, size:], self.from_points.bias
        )
        x = inputs.latents + located[:, None]
        if self.from_point_features is not None:
            x = x.add_(linear_of_columns(point_features, self.from_point_features.weight))
        return self.blocks(x)
