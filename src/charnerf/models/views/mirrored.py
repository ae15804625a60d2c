"""The drawings plus the mirrored side view."""

from typing import final

import torch
from torch import Tensor

from charnerf.geometry.cameras import mirror_views
from charnerf.models.views.base import AbstractViews
from charnerf.types import Cameras, SourceViews

SIDEWAYS = 0.5  # |x| of the viewing axis above which a view counts as seen from a side


@final
class MirroredSide(AbstractViews):
    """Append each side drawing, flipped, as what the character's other side looks like.

    Most characters are their own mirror image but for details; the appended view is flagged, so that the field can weigh it, and it
    carves no hull. Views seen from the front or the back gain nothing and are not doubled.
    """

    def __call__(self, views: SourceViews) -> SourceViews:
        """Return views (B, V + M) for M views that are seen from a side in any character of the batch."""
        sideways = views.cameras.world_from_camera[..., 0, 2].abs() > SIDEWAYS
        columns = (sideways & views.present & ~views.mirrored).any(0).nonzero()[:, 0]
        if len(columns) == 0:
            return views
        side = mirror_views(views[:, columns])
        cameras, widened = views.cameras, views.widened_alphas

        def appended(name: str) -> Tensor:
            return torch.cat((getattr(cameras, name), getattr(side.cameras, name)), dim=1)

        return SourceViews(
            images=torch.cat((views.images, side.images), dim=1),
            cameras=Cameras(
                world_from_camera=appended("world_from_camera"),
                focal=appended("focal"),
                principal_point=appended("principal_point"),
                orthographic=appended("orthographic"),
                width=cameras.width,
                height=cameras.height,
            ),
            present=torch.cat((views.present, side.present & sideways[:, columns]), dim=1),
            mirrored=torch.cat((views.mirrored, torch.ones_like(side.mirrored)), dim=1),
            widened_alphas=None if widened is None else torch.cat((widened, side.carving_alphas), dim=1),
        )
