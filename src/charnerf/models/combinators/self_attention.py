"""H = multi-head self-attention without directions (the paper's row "no view directions in MHA")."""

from typing import final

from torch import Tensor

from charnerf.models.combinators.attention import AbstractAttention, mean_shares


@final
class SelfAttention(AbstractAttention):
    """Self-attention over the views' features.

    Source: paper, Baselines, row 4.
    """

    sees_query = False

    def forward(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        """Fuse (P, V, D) to (P, D); the directions are not read."""
        return self.attend(self.scale * self.feature_logits(view_features), view_features, valid)

    def view_shares(
        self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """Shares (P, V), means over heads and rows; the directions are not read."""
        return mean_shares(self.scale * self.feature_logits(view_features), valid)
