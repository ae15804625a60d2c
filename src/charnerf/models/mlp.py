"""The residual blocks of f1 and f2 (paper, Fig. network; pixelNeRF's form)."""

from typing import final

from torch import Tensor, nn

from charnerf.models.fused import residual_rows


@final
class ResidualBlock(nn.Module):
    """`x + W2 relu(W1 relu(x))`; W2 starts at zero, so that a new block is the identity."""

    def __init__(self, *, width: int) -> None:
        super().__init__()
        self.first = nn.Linear(width, width)
        self.second = nn.Linear(width, width)
        nn.init.kaiming_normal_(self.first.weight)
        nn.init.zeros_(self.first.bias)
        nn.init.zeros_(self.second.weight)
        nn.init.zeros_(self.second.bias)

    def forward(self, x: Tensor) -> Tensor:
        """Apply the block to (..., width)."""
        rows = x.reshape(-1, x.shape[-1])
        first, second = self.first, self.second
        return residual_rows(rows, first.weight, first.bias, second.weight, second.bias).view(x.shape)


def residual_blocks(*, width: int, num_blocks: int) -> nn.Sequential:
    """A chain of residual blocks; no block is the identity."""
    return nn.Sequential(*(ResidualBlock(width=width) for _ in range(num_blocks)))
