"""f2 gives the colour, as the paper."""

from typing import final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.models.heads.base import AbstractHead
from charnerf.models.inputs import PointViews


@final
class RadianceHead(AbstractHead):
    """One linear layer and a sigmoid.

    Args:
        width: D.
    """

    def __init__(self, *, width: int) -> None:
        super().__init__()
        self.rgb = nn.Linear(width, 3)

    def appearance(
        self, features: Tensor, view_features: Tensor, views: PointViews, view_dirs: Tensor
    ) -> Tensor:
        """Colours before the sigmoid, (P, 3), from features (P, D)."""
        raw: Tensor = self.rgb(F.relu(features))
        return raw

    @staticmethod
    def rgb_of(appearance: Tensor, drawn: Tensor) -> Tensor:
        """Their sigmoid."""
        return torch.sigmoid(appearance)

    @staticmethod
    def rgb_planes(appearance: Tensor, drawn: Tensor) -> Tensor:
        """Their sigmoid."""
        return torch.sigmoid(appearance)
