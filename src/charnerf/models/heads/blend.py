"""Colour as a blend of the drawings' own colours, plus a gated free colour (beyond the paper)."""

from typing import final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.models.combinators.base import masked_logits
from charnerf.models.fused import score_rows
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
        cosines = (view_dirs[:, None] * views.dirs).sum(-1, keepdim=True)
        readings = torch.cat((cosines, visibility[..., None], views.rgb), dim=-1)
        addend = self.from_readings(readings) + self.from_features(features)[:, None]
        scores = score_rows(
            view_features.reshape(-1, view_features.shape[-1]),
            addend.reshape(-1, addend.shape[-1]),
            self.from_views.weight,
            self.from_views.bias,
            self.score.weight,
            self.score.bias,
        )
        logits = scores.view(views.valid.shape) + 2.0 * visibility
        return torch.cat((masked_logits(logits, views.valid), self.free(F.relu(features))), dim=-1)

    @staticmethod
    def rgb_of(appearance: Tensor, drawn: Tensor) -> Tensor:
        """The drawings' colours by the softmax of their scores, and the free one by its gate."""
        logits, free = appearance[:, :-4], appearance[:, -4:]
        blended = (torch.softmax(logits, dim=-1)[..., None] * drawn).sum(1)
        return blended + torch.sigmoid(free[:, 3:]) * (torch.sigmoid(free[:, :3]) - blended)

    @staticmethod
    def rgb_planes(appearance: Tensor, drawn: Tensor) -> Tensor:
        """The same, view by view."""
        shares, free = torch.softmax(appearance[:-4], dim=0), torch.sigmoid(appearance[-4:])
        blended = shares[0] * drawn[0]
        for share, colors in zip(shares[1:], drawn[1:], strict=True):
            blended.addcmul_(share, colors)
        return torch.addcmul(blended, free[3:], free[:3] - blended)
