"""H = a mean with weights learned from each view's feature and angle (beyond the paper)."""

from typing import final

import torch
from torch import Tensor, nn

from charnerf.models.combinators.base import AbstractWeighing, masked_logits
from charnerf.models.fused import score_rows, sum_views


@final
class LearnedWeights(AbstractWeighing):
    """Softmax over the views of a small network's score of (feature, cosine to the query, source direction).

    Args:
        width: D.
        hidden: Width of the scoring network.
    """

    sees_query = True

    def __init__(self, *, width: int, hidden: int) -> None:
        super().__init__()
        self.from_features = nn.Linear(width, hidden)
        self.from_angles = nn.Linear(4, hidden, bias=False)
        self.score = nn.Linear(hidden, 1)
        nn.init.zeros_(self.score.weight)  # the start is the mean
        nn.init.zeros_(self.score.bias)

    def forward(self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        """Fuse (P, V, D) to (P, D)."""
        return sum_views(self.view_shares(view_features, view_dirs, source_dirs, valid), view_features)

    def view_shares(
        self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """Weights (P, V) by which the views are averaged."""
        cosines = (view_dirs[:, None] * source_dirs).sum(-1, keepdim=True)
        angles = self.from_angles(torch.cat((cosines, source_dirs), dim=-1))
        logits = score_rows(
            view_features.reshape(-1, view_features.shape[-1]),
            angles.reshape(-1, angles.shape[-1]),
            self.from_features.weight,
            self.from_features.bias,
            self.score.weight,
            self.score.bias,
        ).view(valid.shape)
        return torch.softmax(masked_logits(logits, valid), dim=-1)
