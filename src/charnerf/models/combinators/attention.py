"""What the two attention combinators share: projections, heads, residual, the mean over rows."""

import math

import torch
from torch import Tensor, nn

from charnerf.geometry.safe import safe_normalize
from charnerf.models.combinators.base import AbstractWeighing, masked_logits, view_weights
from charnerf.models.fused import pair_dots, sum_views


class AbstractAttention(AbstractWeighing):
    """Multi-head attention over the views; what enters the softmax beside the features is the combinator's own.

    Args:
        width: D.
        num_heads: K.
        attention_width: Of queries, keys and values, all heads together, a multiple of num_heads; D if None.
        residual: Add the mean of the features to the projected attended values (off in the paper's plain form).
        norm: LayerNorm of that sum; read only with `residual`.
        temperature: Start of a learned factor on the feature logits (1 and fixed in the plain form: None).
        lr_scale: Learning rate of these weights over that of the others.
    """

    def __init__(
        self,
        *,
        width: int,
        num_heads: int,
        attention_width: int | None,
        residual: bool,
        norm: bool,
        temperature: float | None,
        lr_scale: float,
    ) -> None:
        super().__init__()
        inner = attention_width or width
        self.num_heads = num_heads
        self.head_size = inner // num_heads
        self.scale = 1.0 / math.sqrt(self.head_size)
        self.is_residual = residual
        self.lr_scale = lr_scale
        self.queries = nn.Linear(width, inner, bias=False)
        self.keys = nn.Linear(width, inner, bias=False)
        self.values = nn.Linear(width, inner, bias=False)
        self.norm: nn.Module | None = nn.LayerNorm(width) if residual and norm else None
        self.output: nn.Module | None = nn.Linear(inner, width) if residual or inner != width else None
        self.log_temperature = (
            None if temperature is None else nn.Parameter(torch.tensor(math.log(temperature)))
        )

    def split(self, x: Tensor) -> Tensor:
        """Split (P, V, A) into heads, (P, V, K, A / K)."""
        return x.unflatten(-1, (self.num_heads, -1))

    def feature_logits(self, view_features: Tensor) -> Tensor:
        """Cosines of every view's query and every view's key, (P, K, V query, V key), times the temperature."""
        queries = safe_normalize(self.split(self.queries(view_features)))
        keys = safe_normalize(self.split(self.keys(view_features)))
        logits = pair_dots(queries, keys).permute(0, 3, 1, 2)
        return logits if self.log_temperature is None else logits * self.log_temperature.exp()

    def attend(self, logits: Tensor, view_features: Tensor, valid: Tensor) -> Tensor:
        """Attention with logits (P, K, V, V) over features (P, V, D), then the mean over rows: (P, D)."""
        row_weights = view_weights(valid, logits.dtype)
        averaged = _head_shares(logits, row_weights, valid)
        values = self.split(self.values(view_features))
        fused = sum_views(averaged.transpose(1, 2), values).flatten(-2)  # (P, A)
        if self.output is not None:
            fused = self.output(fused)
        if self.is_residual:
            fused = fused + sum_views(row_weights, view_features)
        return fused if self.norm is None else self.norm(fused)


def mean_shares(logits: Tensor, valid: Tensor) -> Tensor:
    """Shares (P, V) of the views by logits (P, K, V, V): means over heads and rows."""
    return _head_shares(logits, view_weights(valid, logits.dtype), valid).mean(1)


def _head_shares(logits: Tensor, row_weights: Tensor, valid: Tensor) -> Tensor:
    """Shares (P, K, V) by logits (P, K, V, V), means over rows: the mean commutes with the weighted sum of values."""
    weights = torch.softmax(masked_logits(logits, valid), dim=-1)
    return (weights * row_weights[:, None, :, None]).sum(2)
