"""What a combinator H is: V per-view features in, one feature out, whatever the number and order of the views."""

from abc import ABC, abstractmethod

from torch import Tensor, nn


class AbstractCombinator(nn.Module, ABC):
    """Combinator H (paper, Overview).

    Attributes:
        sees_query: Whether the result depends on the query direction.
        lr_scale: Learning rate of its weights over that of the others.
    """

    sees_query: bool
    lr_scale: float = 1.0

    @abstractmethod
    def forward(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        """Fuse the views.

        Args:
            view_features: V^(i), (P, V, D).
            view_dirs: d, (P, 3), unit, or zero for "no direction".
            source_dirs: d^(i), (P, V, 3), unit.
            valid: Views that see the point, (P, V), bool; where none does, all count.

        Returns:
            V_multi, (P, D).
        """

    def project(self, view_features: Tensor) -> Tensor:
        """What answers to all directions are made of, (P, V, C), beside V^(i) (P, V, D) themselves: asked once; nothing here."""
        return view_features[..., :0]

    def answer(
        self, view_features: Tensor, projected: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """What `forward` gives, by what `project` gave (P, V, C)."""
        fused: Tensor = self(view_features, view_dirs, source_dirs, valid)
        return fused


class AbstractWeighing(AbstractCombinator):
    """A combinator that decides by the point what each view counts for."""

    @abstractmethod
    def view_shares(
        self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """Shares of the views (P, V), of sum 1, of what `forward` is given."""


def view_weights(valid: Tensor, dtype: object) -> Tensor:
    """Weights (P, V) that average over the valid views, or over all where none is valid."""
    counted = (valid | ~valid.any(-1, keepdim=True)).to(dtype)  # type: ignore[call-overload]
    return counted / counted.sum(-1, keepdim=True)


def masked_logits(logits: Tensor, valid: Tensor) -> Tensor:
    """Logits (P, ..., V) with those of views that do not see the point at minus infinity, unless none sees it."""
    hidden = ~valid & valid.any(-1, keepdim=True)
    return logits.masked_fill(
        hidden.reshape(hidden.shape[0], *[1] * (logits.ndim - 2), hidden.shape[1]), float("-inf")
    )
