"""One stacked hourglass on the whole drawing (row 1 of the paper's Table II)."""

from typing import final

from torch import Tensor

from charnerf.models.encoders.base import AbstractEncoder
from charnerf.models.encoders.hourglass import StackedHourglass


@final
class SingleHourglass(AbstractEncoder):
    """One stacked hourglass.

    Args:
        in_channels: Channels of the images.
        num_stacks: Hourglasses in a row.
        depth: Halvings inside each hourglass.
        width: Channels inside.
        out_channels: Channels of the feature map.
        stride: Image side over feature map side: 1, 2 or 4.

    Source: paper, Encode concept art; PIFu's filters (Saito 2019).
    """

    def __init__(
        self, *, in_channels: int, num_stacks: int, depth: int, width: int, out_channels: int, stride: int
    ) -> None:
        super().__init__()
        self.filter = StackedHourglass(
            in_channels=in_channels,
            num_stacks=num_stacks,
            depth=depth,
            width=width,
            out_channels=out_channels,
            stride=stride,
        )
        self.out_channels = out_channels
        self.multiple = self.filter.multiple

    def forward(self, images: Tensor) -> Tensor:
        """Map images (N, C, H, W) to feature maps (N, F, H / stride, W / stride)."""
        return self.filter(images)
