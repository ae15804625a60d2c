"""The stacked hourglass network (Newell 2016) in PIFu's form: GroupNorm, pre-activation blocks, residual stacks."""

from typing import final

import torch
from torch import Tensor, nn
from torch.nn import functional as F


def group_norm(channels: int) -> nn.GroupNorm:
    """GroupNorm with at most 32 groups of at least 8 channels."""
    groups = max(g for g in range(1, 33) if channels % g == 0 and (channels // g >= 8 or g == 1))
    return nn.GroupNorm(groups, channels)


@final
class PointwiseConv(nn.Conv2d):
    """A 1x1 convolution as a linear layer of the channels: on a CPU the kernel for small convolutions copies to channels first."""

    def __init__(self, in_channels: int, out_channels: int) -> None:
        super().__init__(in_channels, out_channels, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, C_in, h, w) to (N, C_out, h, w), channels last."""
        return F.linear(x.permute(0, 2, 3, 1), self.weight.flatten(1), self.bias).permute(0, 3, 1, 2)


@final
class ConvBlock(nn.Module):
    """Three 3x3 convolutions of C/2, C/4, C/4 channels, concatenated, plus a residual."""

    def __init__(self, *, in_channels: int, out_channels: int) -> None:
        super().__init__()
        half, quarter = out_channels // 2, out_channels // 4
        sizes = ((in_channels, half), (half, quarter), (quarter, out_channels - half - quarter))
        self.norms = nn.ModuleList(group_norm(a) for a, _ in sizes)
        self.convs = nn.ModuleList(nn.Conv2d(a, b, 3, padding=1, bias=False) for a, b in sizes)
        self.skip = nn.Identity() if in_channels == out_channels else PointwiseConv(in_channels, out_channels)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, C_in, h, w) to (N, C_out, h, w)."""
        parts = []
        y = x
        for norm, conv in zip(self.norms, self.convs, strict=True):
            y = conv(F.relu_(norm(y)))
            parts.append(y)
        return torch.cat(parts, dim=1).add_(self.skip(x))


@final
class Hourglass(nn.Module):
    """Down `depth` times and up again, with a skip at each size."""

    def __init__(self, *, depth: int, width: int) -> None:
        super().__init__()
        self.skips = nn.ModuleList(ConvBlock(in_channels=width, out_channels=width) for _ in range(depth))
        self.downs = nn.ModuleList(ConvBlock(in_channels=width, out_channels=width) for _ in range(depth))
        self.ups = nn.ModuleList(ConvBlock(in_channels=width, out_channels=width) for _ in range(depth))
        self.bottom = ConvBlock(in_channels=width, out_channels=width)

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, width, h, w) to the same shape; h and w are multiples of 2^depth."""
        skips = []
        for skip, down in zip(self.skips, self.downs, strict=True):
            skips.append(skip(x))
            x = down(F.avg_pool2d(x, 2))
        x = self.bottom(x)
        for skip, up in zip(reversed(skips), self.ups, strict=True):
            x = F.interpolate(up(x), scale_factor=2, mode="bilinear", align_corners=False) + skip
        return x


@final
class StackedHourglass(nn.Module):
    """A stem of stride `stride`, then hourglasses one after the other; the last one's output is the feature map.

    Args:
        in_channels: Channels of the images.
        num_stacks: Hourglasses in a row.
        depth: Halvings inside each.
        width: Channels inside.
        out_channels: Channels of the feature map.
        stride: 1, 2 or 4: size of the image over that of the feature map.
    """

    def __init__(
        self, *, in_channels: int, num_stacks: int, depth: int, width: int, out_channels: int, stride: int
    ) -> None:
        super().__init__()
        self.multiple = stride * 2**depth
        first_stride = 2 if stride > 1 else 1
        self.stem = nn.Conv2d(
            in_channels, width, 7 if stride > 1 else 3, stride=first_stride, padding=3 if stride > 1 else 1
        )
        self.pool = nn.AvgPool2d(2) if stride == 4 else nn.Identity()
        self.entry = ConvBlock(in_channels=width, out_channels=width)
        self.hourglasses = nn.ModuleList(Hourglass(depth=depth, width=width) for _ in range(num_stacks))
        self.tops = nn.ModuleList(
            nn.Sequential(
                ConvBlock(in_channels=width, out_channels=width),
                PointwiseConv(width, width),
                group_norm(width),
                nn.ReLU(),
            )
            for _ in range(num_stacks)
        )
        self.outputs = nn.ModuleList(PointwiseConv(width, out_channels) for _ in range(num_stacks))
        # the way back into the trunk, for all stacks but the last
        self.features_back = nn.ModuleList(PointwiseConv(width, width) for _ in range(num_stacks - 1))
        self.outputs_back = nn.ModuleList(PointwiseConv(out_channels, width) for _ in range(num_stacks - 1))

    def forward(self, images: Tensor) -> Tensor:
        """Map images (N, C, H, W) to features (N, F, H / stride, W / stride)."""
        x = self.entry(self.pool(self.stem(images)))
        stacks = len(self.hourglasses)
        for i in range(stacks):
            features = self.tops[i](self.hourglasses[i](x))
            output = self.outputs[i](features)
            if i < stacks - 1:
                x = x + self.features_back[i](features) + self.outputs_back[i](output)
        return output
