"""What a head is: from features to colour."""

from abc import ABC, abstractmethod

from torch import Tensor, nn

from charnerf.models.inputs import PointViews


class AbstractHead(nn.Module, ABC):
    """Colour head: the last part of f2."""

    @abstractmethod
    def forward(
        self, features: Tensor, view_features: Tensor, views: PointViews, view_dirs: Tensor
    ) -> Tensor:
        """Colours of points.

        Args:
            features: Output of the multi-view blocks, (P, D).
            view_features: V^(i), (P, V, D).
            views: What the source views show of the points.
            view_dirs: (P, 3).

        Returns:
            rgb, (P, 3), in [0, 1].
        """
