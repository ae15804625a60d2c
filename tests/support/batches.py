"""A training batch by hand."""

from dataclasses import replace
from typing import Any

import torch

from charnerf.types import Cameras, RayBundle, SourceViews, SpacePoints, SurfacePoints, TrainBatch


def small_batch(**changes: Any) -> TrainBatch:
    """Two rays, one surface point, two labelled points of one character."""
    flags = torch.ones(1, 1, dtype=torch.bool)
    cameras = Cameras(torch.eye(4)[None, None], torch.ones(1, 1, 2), torch.ones(1, 1, 2), flags, 2, 2)
    made = TrainBatch(
        names=("hero",),
        views=SourceViews(torch.zeros(1, 1, 4, 2, 2), cameras, flags, ~flags),
        hull=None,
        rays=RayBundle(torch.zeros(1, 2, 3), torch.ones(1, 2, 3)),
        rgb=torch.tensor((((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),)),
        alpha=torch.tensor(((0.0, 1.0),)),
        square=0,
        depth=torch.tensor(((0.0, 4.0),)),
        surface=SurfacePoints(torch.zeros(1, 1, 3), torch.tensor((((0.5, 0.5, 0.5),),))),
        space=SpacePoints(torch.zeros(1, 2, 3), torch.tensor(((1.0, 0.0),))),
        phase=0,
        loss_weights={},
        step=0,
        seeds=(0,),
    )
    return replace(made, **changes)
