"""What an encoder E is: drawings in, feature maps out, each drawing by itself."""

from abc import ABC, abstractmethod

from torch import Tensor, nn


class AbstractEncoder(nn.Module, ABC):
    """Encoder E (paper, Encode concept art).

    Attributes:
        out_channels: Channels F of the feature map.
        multiple: Image sides must be a multiple of this.
    """

    out_channels: int
    multiple: int

    @abstractmethod
    def forward(self, images: Tensor) -> Tensor:
        """Map images (N, C, H, W) to feature maps (N, F, h, w)."""

    def begin(self) -> str | None:
        """Take weights from elsewhere, where this encoder has such; called before a training from the start.

        Returns:
            What to tell about where the training begins, None where there is nothing to tell.
        """
        return None
