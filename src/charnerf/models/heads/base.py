"""What a head is: from features to colour."""

from abc import ABC, abstractmethod

from torch import Tensor, nn

from charnerf.models.inputs import PointViews


class AbstractHead(nn.Module, ABC):
    """Colour head: the last part of f2, in two steps."""

    def forward(
        self, features: Tensor, view_features: Tensor, views: PointViews, view_dirs: Tensor
    ) -> Tensor:
        """Colours of points, (P, 3), in [0, 1]; arguments as of `appearance`."""
        return self.rgb_of(self.appearance(features, view_features, views, view_dirs), views.rgb)

    @abstractmethod
    def appearance(
        self, features: Tensor, view_features: Tensor, views: PointViews, view_dirs: Tensor
    ) -> Tensor:
        """What the network says of colours of points.

        Args:
            features: Output of the multi-view blocks, (P, D).
            view_features: V^(i), (P, V, D).
            views: What the source views show of the points.
            view_dirs: (P, 3).

        Returns:
            (P, C).
        """

    @staticmethod
    @abstractmethod
    def rgb_of(appearance: Tensor, drawn: Tensor) -> Tensor:
        """Colours (P, 3), in [0, 1], of that (P, C) and of the drawings' own colours there (P, V, 3); no weight takes part."""

    @staticmethod
    @abstractmethod
    def rgb_planes(appearance: Tensor, drawn: Tensor) -> Tensor:
        """The same colours (3, ..., P) of (C, ..., P) and (V, 3, ..., P): for many points, in passes over memory."""
