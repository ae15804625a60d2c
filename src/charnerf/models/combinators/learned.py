"""H = a mean with weights learned from each view's feature and angle (beyond the paper)."""

from typing import final

from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.models.combinators.base import AbstractWeighing, masked_logits
from charnerf.models.fused import once, score_views, softmax_views, sum_views, view_cosines


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
        return self.answer(view_features, self.project(view_features), view_dirs, source_dirs, valid)

    def project(self, view_features: Tensor) -> Tensor:
        """The features' part of the scoring network, (P, V, hidden)."""
        return F.linear(view_features, self.from_features.weight)

    def answer(
        self, view_features: Tensor, projected: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """The mean of (P, V, D) by the shares."""
        return sum_views(self._shares(projected, view_dirs, source_dirs, valid), view_features)

    def view_shares(
        self, view_features: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor
    ) -> Tensor:
        """Weights (P, V) by which the views are averaged."""
        return self._shares(self.project(view_features), view_dirs, source_dirs, valid)

    def _shares(self, projected: Tensor, view_dirs: Tensor, source_dirs: Tensor, valid: Tensor) -> Tensor:
        sources, weight = once(source_dirs), self.from_angles.weight
        cosines = view_cosines(once(view_dirs), sources)
        angles = F.linear(sources, weight[:, 1:], self.from_features.bias) + cosines[..., None] * weight[:, 0]
        logits = score_views(projected, angles, self.score.weight, self.score.bias)
        return softmax_views(masked_logits(logits, valid))
