"""H = view-direction-attended multi-head self-attention, the paper's own combinator."""

import math
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor, nn

from charnerf.geometry.safe import safe_normalize
from charnerf.models.combinators.attention import AbstractAttention, mean_shares


@dataclass(frozen=True)
class AttentionLogits:
    """A head's logits split exactly: features (P, K, V, V) and view (P, K, V, V); their sum enters the softmax."""

    features: Tensor
    view: Tensor


@final
class ViewAttention(AbstractAttention):
    """Attention with Q = V^(i) + s d and K = V^(i) + s d^(i), "+" concatenating.

    Each head holds its slice of the projected, normalised features and the whole direction, and no projection mixes the two, so
    that its logit is exactly a feature part plus a view part. Directions are signed: front and back differ.

    Args:
        view_scale: Start of the learned factor s; 0 would be a stationary point.
        width: This and all others: see AbstractAttention.
        num_heads: K.
        attention_width: Of queries, keys and values.
        residual: Add the mean of the features.
        norm: LayerNorm of that sum.
        temperature: Start of a factor on the feature logits.
        lr_scale: Learning rate over that of the others.

    Source: paper, View direction attended multi-head self attention; what it leaves open is chosen in the notes: the n rows are
    averaged, s starts at 1.
    """

    sees_query = True

    def __init__(
        self,
        *,
        view_scale: float,
        width: int,
        num_heads: int,
        attention_width: int | None,
        residual: bool,
        norm: bool,
        temperature: float | None,
        lr_scale: float,
    ) -> None:
        super().__init__(
            width=width,
            num_heads=num_heads,
            attention_width=attention_width,
            residual=residual,
            norm=norm,
            temperature=temperature,
            lr_scale=lr_scale,
        )
        self.view_scale = nn.Parameter(torch.tensor(float(view_scale)))
        self.scale = 1.0 / math.sqrt(self.head_size + 3)

    def logits(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor) -> AttentionLogits:
        """The two parts of the scaled dot products (the paper's analysis plots their means)."""
        features = self.scale * self.feature_logits(view_features)
        cosines = (safe_normalize(view_dirs)[:, None] * safe_normalize(source_dirs)).sum(-1)  # (P, V key)
        view = (self.scale * self.view_scale.square() * cosines)[:, None, None, :].expand_as(features)
        return AttentionLogits(features=features, view=view)

    def forward(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        """Fuse (P, V, D) to (P, D)."""
        logits = self.logits(view_features, view_dirs, source_dirs)
        return self.attend(logits.features + logits.view, view_features, valid)

    def view_shares(
        self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """Shares (P, V), means over heads and rows."""
        logits = self.logits(view_features, view_dirs, source_dirs)
        return mean_shares(logits.features + logits.view, valid)
