"""Two stacked hourglasses in parallel: coarse on a reduced drawing, fine on the full one, concatenated."""

from typing import final

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.models.encoders.base import AbstractEncoder
from charnerf.models.encoders.hourglass import StackedHourglass


@final
class DoubleHourglass(AbstractEncoder):
    """Coarse and fine stacked hourglass, concatenated at the fine map's size.

    Args:
        in_channels: Channels of the images.
        coarse_stacks: Hourglasses in a row of the coarse part.
        fine_stacks: Hourglasses in a row of the fine part.
        depth: Halvings inside each hourglass.
        coarse_width: Channels inside the coarse part.
        fine_width: Channels inside the fine part.
        coarse_channels: Channels of the coarse feature map.
        fine_channels: Channels of the fine feature map.
        reduction: By how much the coarse part's image is smaller.
        stride: Image side over feature map side, of both parts.

    Source: paper, Encode concept art: the two maps are concatenated (no MLP between them as in PIFuHD).
    """

    def __init__(
        self,
        *,
        in_channels: int,
        coarse_stacks: int,
        fine_stacks: int,
        depth: int,
        coarse_width: int,
        fine_width: int,
        coarse_channels: int,
        fine_channels: int,
        reduction: int,
        stride: int,
    ) -> None:
        super().__init__()
        self.coarse = StackedHourglass(
            in_channels=in_channels,
            num_stacks=coarse_stacks,
            depth=depth,
            width=coarse_width,
            out_channels=coarse_channels,
            stride=stride,
        )
        self.fine = StackedHourglass(
            in_channels=in_channels,
            num_stacks=fine_stacks,
            depth=depth,
            width=fine_width,
            out_channels=fine_channels,
            stride=stride,
        )
        self.reduction = reduction
        self.out_channels = coarse_channels + fine_channels
        self.multiple = reduction * self.coarse.multiple

    def forward(self, images: Tensor) -> Tensor:
        """Map images (N, C, H, W) to feature maps (N, F, H / stride, W / stride)."""
        fine = self.fine(images)
        coarse = self.coarse(F.avg_pool2d(images, self.reduction))
        upsampled = F.interpolate(coarse, size=fine.shape[-2:], mode="bilinear", align_corners=False)
        return torch.cat((upsampled, fine), dim=1)
