"""Pictures with their cameras on squares of one size, as geometry looks at them."""

from collections.abc import Sequence

import numpy as np
import torch
from torch.nn import functional as F

from charnerf.doctor.views import Seen, View
from charnerf.geometry.resizing import resized_pictures
from charnerf.types import Cameras

SIDE = 128  # pixels


def seen(views: Sequence[View], pictures: Sequence[np.ndarray], alphas: Sequence[np.ndarray]) -> Seen:
    """What was read of views, scaled so that longer sides have SIDE pixels, in the middle of squares.

    Args:
        views: N of them.
        pictures: uint8 (H, W, 4) each.
        alphas: (H, W) each, in [0, 1].
    """
    canvases, focals, centres = [], [], []
    for view, picture, alpha in zip(views, pictures, alphas, strict=True):
        height, width = alpha.shape
        wide, tall = (max(1, round(side * SIDE / max(width, height))) for side in (width, height))
        rgba = torch.from_numpy(
            np.concatenate((picture[..., :3] / 255.0 * alpha[..., None], alpha[..., None]), axis=-1)
        )
        small = resized_pictures(rgba.float().permute(2, 0, 1)[None], wide, tall)[0]
        left, top = (SIDE - wide) // 2, (SIDE - tall) // 2
        canvases.append(F.pad(small, (left, SIDE - wide - left, top, SIDE - tall - top)))
        stated = view.size
        focals.append((view.focal[0] * wide / stated[0], view.focal[1] * tall / stated[1]))
        centres.append((view.centre[0] * wide / stated[0] + left, view.centre[1] * tall / stated[1] + top))
    squares = torch.stack(canvases).clamp(0.0, 1.0)
    on_white = squares[:, :3] + 1.0 - squares[:, 3:]
    return Seen(
        views=tuple(views),
        cameras=Cameras(
            world_from_camera=torch.from_numpy(np.stack([view.matrix for view in views])),
            focal=torch.tensor(focals, dtype=torch.float64),
            principal_point=torch.tensor(centres, dtype=torch.float64),
            orthographic=torch.tensor([view.is_orthographic for view in views]),
            width=SIDE,
            height=SIDE,
        ),
        alphas=squares[:, 3],
        rgb=(255.0 * on_white.clamp(0.0, 1.0)).round().to(torch.uint8).permute(0, 2, 3, 1).numpy(),
    )
