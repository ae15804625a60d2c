"""Colour as a blend of the drawings' own colours, plus a gated free colour (beyond the paper)."""

from typing import final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.models.combinators.base import masked_logits
from charnerf.models.fused import once, score_views, view_cosines
from charnerf.models.heads.base import AbstractHead
from charnerf.models.inputs import PointViews


@final
class BlendHead(AbstractHead):
    """Softmax over the projected source colours; a gate mixes in a free colour where no drawing shows the point.

    Args:
        width: D.
        hidden: Width of the scoring network.
    """

    def __init__(self, *, width: int, hidden: int) -> None:
        super().__init__()
        self.from_views = nn.Linear(width, hidden)
        self.from_features = nn.Linear(width, hidden, bias=False)
        self.from_readings = nn.Linear(5, hidden, bias=False)
        self.score = nn.Linear(hidden, 1)
        self.free = nn.Linear(width, 4)
        with torch.no_grad():
            self.free.bias[3] = -2.0  # the gate starts nearly closed: colours come from the drawings

    def appearance(
        self, features: Tensor, view_features: Tensor, views: PointViews, view_dirs: Tensor
    ) -> Tensor:
        """Scores of the views, then the free colour and the gate before their sigmoids, (P, V + 4)."""
        visibility = views.visibility
        cosines = view_cosines(once(view_dirs), once(views.dirs)).expand_as(visibility)
        readings = torch.cat((torch.stack((cosines, visibility), dim=-1), views.rgb), dim=-1)
        of_all = F.linear(features, self.from_features.weight, self.from_views.bias)
        scores = score_views(
            F.linear(view_features, self.from_views.weight),
            self.from_readings(readings) + of_all[:, None],
            self.score.weight,
            self.score.bias,
        )
        logits = scores + 2.0 * visibility
        return torch.cat((masked_logits(logits, views.valid), self.free(F.relu(features))), dim=-1)

    @staticmethod
    def rgb_of(appearance: Tensor, drawn: Tensor) -> Tensor:
        """The drawings' colours by the softmax of their scores, and the free one by its gate."""
        return BlendHead.rgb_planes(appearance.t().contiguous(), drawn.permute(1, 2, 0)).t()

    @staticmethod
    def rgb_planes(appearance: Tensor, drawn: Tensor) -> Tensor:
        """The same, view by view."""
        shares, free = torch.softmax(appearance[:-4], dim=0), torch.sigmoid(appearance[-4:])
        blended = shares[0] * drawn[0]
        for share, colors in zip(shares[1:], drawn[1:], strict=True):
            blended.addcmul_(share, colors)
        return torch.addcmul(blended, free[3:], free[:3] - blended)
