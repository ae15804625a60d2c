"""What the visual hull cuts away: pixels that show the character and whose rays meet no cell of its hull."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch

from charnerf.bench.subjects import Pictured
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.geometry.hull import occupied_edges
from charnerf.models.charnerf import CharNeRF

STEPS = 256  # in which a ray looks the hull up
SHOWN_ALPHA = 0.5  # a pixel that is covered this much shows the character


@torch.no_grad()
def cut_by_hull(network: CharNeRF, pictured: Sequence[Pictured]) -> list[dict[str, Any]]:
    """Count, for each character, the target picture's pixels that show it and those that its hull has lost.

    Args:
        network: Carves; without a hull there are no rows.
        pictured: Characters.
    """
    rows = []
    for one in pictured:
        hulls = network.carve(one.views.to(network.box[0].device))
        if hulls is None:
            return []
        camera = one.camera.to(hulls.box_min.device)
        shown = one.picture[..., 3].to(hulls.box_min.device) > SHOWN_ALPHA
        pixels = pixel_centres(camera.width, camera.height, device=shown.device)[shown]
        _, occupied = occupied_edges(hulls[0], pixel_rays(camera, pixels.to(camera.focal.dtype)), STEPS)
        lost = int((~occupied.any(-1)).sum())
        rows.append({"character": one.name, "pixels shown": len(pixels), "cut": lost})
    return rows
