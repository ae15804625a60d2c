"""The figure that silhouettes of cameras in any world have in common: where it is, and how large.

The hull that models need is carved in our frame (hull.py), where a character's place and size are known; here they are asked.
"""

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.errors import DataError
from charnerf.geometry.cameras import pixel_rays, project_into_all
from charnerf.types import Cameras

MOST_CARVING = 48  # pictures that the figure is measured by
GRID = 64  # cells a side
ROUNDS = 3  # a figure of a few cells fills a grid after two; the last one measures
INSIDE = 0.5  # alpha
ROOM = 1.3  # of the first box over what the silhouettes reach at the point that all look at


def figure_box(cameras: Cameras, alphas: Tensor) -> tuple[Tensor, Tensor]:
    """Bounding box of the visual hull of silhouettes, corners (3,), float64, to a sixtieth of its sides.

    Args:
        cameras: (N,), pinhole or orthographic, in any world.
        alphas: (N, H, W), in [0, 1].

    Raises:
        DataError: If silhouettes are empty, or have no point in common.
    """
    index = (alphas > INSIDE).flatten(1).any(1).nonzero()[:, 0]
    if len(index) < 2:
        raise DataError(
            f"found {len(index)} pictures that show a figure, expected at least 2; check alpha and masks."
        )
    index = spread(index, MOST_CARVING)
    points, cell = figure_cells(cameras[index], alphas[index])
    return points.amin(0) - 0.5 * cell, points.amax(0) + 0.5 * cell


def spread(index: Tensor, most: int) -> Tensor:
    """At most so many of indices (N,), evenly chosen."""
    return index[torch.linspace(0, len(index) - 1, min(len(index), most)).round().long()]


def figure_cells(cameras: Cameras, alphas: Tensor, *, misses: int = 0) -> tuple[Tensor, Tensor]:
    """Centres (K, 3) of the cells of a grid that fits the figure, and a cell's sides (3,), float64.

    Args:
        cameras: (N,).
        alphas: (N, H, W), in [0, 1], none of them empty.
        misses: Silhouettes that may leave a cell out: so many cameras may be wrong.

    Raises:
        DataError: If the silhouettes have no point in common.
    """
    cameras, alphas = cameras.to(torch.float64), alphas.double()
    low, high = first_box(cameras, alphas > INSIDE, misses=misses)
    for _ in range(ROUNDS):
        points, cell = _carved(cameras, alphas, low, high, misses)
        if len(points) == 0:
            raise DataError(
                "its silhouettes have no point in common, expected cameras that see one figure: poses of another convention, or"
                " pictures in another order? `charnerf doctor` tells; --keep-frame takes the frame as it is."
            )
        low, high = points.amin(0) - cell, points.amax(0) + cell
    return points, cell


def first_box(cameras: Cameras, masks: Tensor, *, misses: int = 0) -> tuple[Tensor, Tensor]:
    """A cube that holds the figure: around the point nearest to the rays through the silhouettes' middles.

    Args:
        cameras: (N,), float64.
        masks: (N, H, W), bool, none of them empty.
        misses: Rays that are left out, the farthest from that point.

    Raises:
        DataError: If the rays are all parallel, or more cameras than that look away from the point.
    """
    corners = torch.stack([_mask_box(mask) for mask in masks])  # (N, 2 corners, 2)
    rays = pixel_rays(cameras, corners.mean(1))
    eye = torch.eye(3, dtype=torch.float64)
    across = eye - rays.directions[:, :, None] * rays.directions[:, None, :]
    kept = torch.arange(len(masks))
    for count in (len(masks), len(masks) - misses):
        normal, right = across[kept].sum(0), (across[kept] @ rays.origins[kept, :, None]).sum(0)
        if float(torch.linalg.eigvalsh(normal)[0]) < 1e-6 * len(kept):
            raise DataError("found cameras that all look one way, expected views from around the figure.")
        centre = torch.linalg.solve(normal, right)[:, 0]
        apart = (across @ (centre - rays.origins)[..., None])[..., 0].norm(dim=-1)
        kept = apart.argsort()[:count]
    _, depth, in_front = project_into_all(cameras[kept], centre[None])
    away = int((~in_front).sum())
    if away > misses:
        raise DataError(
            f"found {away} of {len(masks)} cameras that look away from the figure, expected none:"
            " they may look along +Z (OpenCV), or their poses be inverted. `charnerf doctor` tells."
        )
    size = (corners[kept, 1] - corners[kept, 0]).norm(dim=-1) / cameras.focal[kept].amin(-1)
    reach = size * torch.where(cameras.orthographic[kept], 1.0, depth[0].clamp_min(0.0)) / 2.0
    half = ROOM * reach.amax()
    return centre - half, centre + half


def _mask_box(mask: Tensor) -> Tensor:
    """Corners (2, 2) of a mask's figure, pixels, x then y."""
    y, x = mask.nonzero().double().unbind(-1)
    return torch.stack((torch.stack((x.amin(), y.amin())), torch.stack((x.amax(), y.amax())) + 1.0))


def _carved(
    cameras: Cameras, alphas: Tensor, low: Tensor, high: Tensor, misses: int
) -> tuple[Tensor, Tensor]:
    """Centres (K, 3) of the cells of a grid whose centres all silhouettes but some cover, and a cell's sides.

    What a picture does not frame it says nothing of; a cell that less than half of the pictures frame is left out.
    """
    axis = (torch.arange(GRID, dtype=torch.float64) + 0.5) / GRID
    unit = torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), dim=-1).reshape(-1, 3)
    points = low + unit * (high - low)
    counts = torch.zeros(len(points), 2, dtype=torch.long)  # framed, missed
    for view in range(len(alphas)):
        pixels, _, in_front = project_into_all(cameras[view : view + 1], points)
        at = 2.0 * pixels[:, 0] / points.new_tensor((cameras.width, cameras.height)) - 1.0
        seen = in_front[:, 0] & (at.abs() < 1.0).all(-1)
        covered = F.grid_sample(
            alphas[view][None, None], at[None, None], align_corners=False, padding_mode="border"
        )[0, 0, 0]
        counts = counts + torch.stack((seen, seen & (covered <= INSIDE)), dim=-1)
        held = counts[:, 1] <= misses
        points, counts = points[held], counts[held]
    return points[2 * counts[:, 0] >= len(alphas)], (high - low) / GRID
