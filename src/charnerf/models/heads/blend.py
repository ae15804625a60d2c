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

    def forward(
        self, features: Tensor, view_features: Tensor, views: PointViews, view_dirs: Tensor
    ) -> Tensor:
        """Colours (P, 3)."""
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
        weights = torch.softmax(masked_logits(logits, views.valid), dim=-1)
        blended = (weights[..., None] * views.rgb).sum(1)
        free = self.free(F.relu(features))
        return blended + torch.sigmoid(free[:, 3:]) * (torch.sigmoid(free[:, :3]) - blended)
