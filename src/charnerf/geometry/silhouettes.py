"""Which pixels of a camera may show anything of a hull: the rest need no ray."""

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.geometry.cameras import project_into_all
from charnerf.types import Cameras, Hull

POINTS_AT_ONCE = 2**18  # projections; more leave the caches


def hull_silhouettes(hull: Hull, cameras: Cameras) -> Tensor:
    """Pixels whose rays may meet a hull; conservative: no ray that meets an occupied cell is missed.

    A ray that meets the hull passes through one of its outermost cells, so that these alone are projected: their centres, and
    then as many pixels around as half the diagonal of a cell covers.

    Args:
        hull: One character's hull.
        cameras: Cameras (N,), outside of the hull.

    Returns:
        (N, H, W), bool.
    """
    cells = _outer_cells(hull.occupancy)
    size = (hull.box_max - hull.box_min) / hull.occupancy.shape[0]
    centres = hull.box_min + (cells + 0.5) * size
    silhouettes = [
        _splat(cameras[i : i + 1], centres, 0.5 * float(size.norm())) for i in range(len(cameras.focal))
    ]
    return torch.stack(silhouettes)


def _outer_cells(occupancy: Tensor) -> Tensor:
    """Indices (P, 3) of occupied cells with a neighbour over a face that is not."""
    padded = F.pad(occupancy, (1, 1, 1, 1, 1, 1))
    inner = padded[1:-1, 1:-1, 1:-1].clone()
    for axis in range(3):
        for start in (0, 2):
            span = [slice(1, -1)] * 3
            span[axis] = slice(start, start + occupancy.shape[axis])
            inner &= padded[tuple(span)]
    return (occupancy & ~inner).nonzero()


def _splat(camera: Cameras, centres: Tensor, radius: float) -> Tensor:
    """Pixels (H, W) within a radius, m, of the projections of centres (P, 3) into a camera of shape (1,)."""
    height, width = camera.height, camera.width
    seen = torch.zeros(height, width, dtype=torch.bool, device=centres.device)
    if len(centres) == 0:
        return seen
    nearest, slant = torch.inf, 0.0
    for some in centres.split(POINTS_AT_ONCE):
        pixels, depth, in_front = project_into_all(camera, some)
        x, y = pixels[:, 0].floor().long().unbind(-1)
        seen[y.clamp(0, height - 1)[in_front[:, 0]], x.clamp(0, width - 1)[in_front[:, 0]]] = True
        nearest = min(nearest, float(depth.min()))
        slant = max(slant, float(((pixels - camera.principal_point) / camera.focal).abs().max()))
    if nearest <= radius and not bool(camera.orthographic):
        return torch.ones_like(seen)
    # x / z of a point within the radius differs from that of the centre by at most this, over z
    shrink = 1.0 if bool(camera.orthographic) else (1.0 + slant**2) ** 0.5 / (nearest - radius)
    reach = int(float(camera.focal.amax()) * radius * shrink + 0.5)
    spread = F.max_pool2d(seen[None, None].float(), (2 * reach + 1, 1), stride=1, padding=(reach, 0))
    return F.max_pool2d(spread, (1, 2 * reach + 1), stride=1, padding=(0, reach))[0, 0] > 0
