"""H = the mean over the views (pixelNeRF; the paper's row "no MHA")."""

from typing import final

from torch import Tensor

from charnerf.models.combinators.base import AbstractCombinator, view_weights
from charnerf.models.fused import sum_views


@final
class Mean(AbstractCombinator):
    """Mean over the views that see the point."""

    sees_query = False

    def forward(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        """Average (P, V, D) to (P, D)."""
        return sum_views(view_weights(valid, view_features.dtype), view_features)
