"""H = multi-head self-attention without directions (the paper's row "no view directions in MHA")."""

import math
from typing import final

from torch import Tensor

from charnerf.geometry.safe import safe_normalize
from charnerf.models.combinators.attention import AttentionParts
from charnerf.models.combinators.base import AbstractCombinator


@final
class SelfAttention(AbstractCombinator):
    """Self-attention over the views' features.

    Args:
        width: D.
        num_heads: K.
        residual: See AttentionParts.
        temperature: See AttentionParts.
        attention_width: See AttentionParts.
        norm: See AttentionParts.
        rate: Learning rate of these weights over that of the others.

    Source: paper, Baselines, row 4.
    """

    sees_query = False

    def __init__(
        self,
        *,
        width: int,
        num_heads: int,
        residual: bool,
        temperature: float | None,
        attention_width: int | None,
        norm: bool,
        rate: float,
    ) -> None:
        super().__init__()
        self.parts = AttentionParts(
            width=width,
            num_heads=num_heads,
            attention_width=attention_width,
            residual=residual,
            norm=norm,
            temperature=temperature,
        )
        self.rate = rate
        self.scale = 1.0 / math.sqrt(self.parts.head_size)

    def forward(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        """Fuse (P, V, D) to (P, D); the directions are not read."""
        queries = safe_normalize(self.parts.split(self.parts.queries(view_features)))
        keys = safe_normalize(self.parts.split(self.parts.keys(view_features)))
        return self.parts.attend(self.scale * self.parts.feature_logits(queries, keys), view_features, valid)
