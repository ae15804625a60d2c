"""The frame of foreign worlds: upright, on the floor, 2 m tall, as every character of ours stands."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.errors import DataError
from charnerf.geometry.cameras import direction_from_angles, pixel_rays, project_into_all
from charnerf.geometry.world import HEIGHT
from charnerf.types import Cameras

MOST_CARVING = 48  # pictures that the figure is measured by
GRID = 64  # cells a side
ROUNDS = 3  # a figure of a few cells fills a grid after two; the last one measures
INSIDE = 0.5  # alpha
ROOM = 1.3  # of the first box over what the silhouettes reach at the point that all look at


@dataclass(frozen=True)
class Similarity:
    """x to scale * rotation x + shift, float64: rotation (3, 3), shift (3,)."""

    rotation: Tensor
    scale: float
    shift: Tensor

    def cameras(self, cameras: Cameras) -> Cameras:
        """Cameras (...) that see the moved world as they saw the world."""
        poses = cameras.world_from_camera.double()
        moved = poses.clone()
        moved[..., :3, :3] = self.rotation @ poses[..., :3, :3]
        moved[..., :3, 3] = self.scale * (poses[..., :3, 3] @ self.rotation.T) + self.shift
        focal = cameras.focal.double()
        focal = torch.where(cameras.orthographic[..., None], focal / self.scale, focal)
        return replace(cameras, world_from_camera=moved, focal=focal)


def standing(cameras: Cameras, alphas: Tensor) -> Similarity:
    """What brings a figure onto the floor, around the z axis and to 2 m, by the visual hull of its silhouettes.

    Args:
        cameras: (N,), in an upright world.
        alphas: (N, H, W), in [0, 1].

    Raises:
        DataError: If the silhouettes are empty or have no point in common.
    """
    low, high = figure_box(cameras, alphas)
    scale = HEIGHT / float(high[2] - low[2])
    middle = 0.5 * (low + high)
    floor = torch.stack((middle[0], middle[1], low[2]))
    return Similarity(torch.eye(3, dtype=torch.float64), scale, -scale * floor)


def figure_box(cameras: Cameras, alphas: Tensor) -> tuple[Tensor, Tensor]:
    """Bounding box of the visual hull of silhouettes, corners (3,), float64, to a sixtieth of its sides.

    Raises:
        DataError: If silhouettes are empty, or have no point in common.
    """
    index = (alphas > INSIDE).flatten(1).any(1).nonzero()[:, 0]
    if len(index) < 2:
        raise DataError(
            f"found {len(index)} pictures that show a figure, expected at least 2; check alpha and masks."
        )
    index = index[torch.linspace(0, len(index) - 1, min(len(index), MOST_CARVING)).round().long()]
    cameras, alphas = cameras[index].to(torch.float64), alphas[index].double()
    low, high = _first_box(cameras, alphas > INSIDE)
    for _ in range(ROUNDS):
        inside, cell = _carved(cameras, alphas, low, high)
        if len(inside) == 0:
            raise DataError(
                "its silhouettes have no point in common, expected cameras that see one figure: poses of another convention, or"
                " pictures in another order? `charnerf doctor` tells; --keep-frame takes the frame as it is."
            )
        low, high = inside.amin(0) - cell, inside.amax(0) + cell
    return low + 0.5 * cell, high - 0.5 * cell


def azimuth_turn(direction: Tensor) -> Tensor:
    """Rotation (3, 3) about z that brings a camera in a direction (3,) from the figure to azimuth 0."""
    angle = torch.atan2(direction[0], -direction[1])
    cosine, sine, zero, one = (
        torch.cos(angle),
        torch.sin(angle),
        torch.zeros_like(angle),
        torch.ones_like(angle),
    )
    return torch.stack((cosine, sine, zero, -sine, cosine, zero, zero, zero, one)).reshape(3, 3)


def level_direction(azimuth_deg: float) -> Tensor:
    """Unit vector (3,), float64, towards a level camera at an azimuth."""
    angle = torch.tensor(azimuth_deg, dtype=torch.float64)
    return direction_from_angles(angle, torch.zeros_like(angle))


def _first_box(cameras: Cameras, masks: Tensor) -> tuple[Tensor, Tensor]:
    """A cube that holds the figure: around the point nearest to the rays through the silhouettes' middles."""
    corners = torch.stack([_mask_box(mask) for mask in masks])  # (N, 2 corners, 2)
    rays = pixel_rays(cameras, corners.mean(1))
    eye = torch.eye(3, dtype=torch.float64)
    across = eye - rays.directions[:, :, None] * rays.directions[:, None, :]
    normal, right = across.sum(0), (across @ rays.origins[..., None]).sum(0)
    if float(torch.linalg.eigvalsh(normal)[0]) < 1e-6 * len(masks):
        raise DataError("found cameras that all look one way, expected views from around the figure.")
    centre = torch.linalg.solve(normal, right)[:, 0]
    _, depth, in_front = project_into_all(cameras, centre[None])
    if not bool(in_front.all()):
        raise DataError(
            f"found {int((~in_front).sum())} of {len(masks)} cameras that look away from the figure, expected none:"
            " they may look along +Z (OpenCV), or their poses be inverted. `charnerf doctor` tells."
        )
    reach = (corners[:, 1] - corners[:, 0]).norm(dim=-1) / cameras.focal.amin(-1) * depth[0] / 2.0
    half = ROOM * reach.amax()
    return centre - half, centre + half


def _mask_box(mask: Tensor) -> Tensor:
    """Corners (2, 2) of a mask's figure, pixels, x then y."""
    y, x = mask.nonzero().double().unbind(-1)
    return torch.stack((torch.stack((x.amin(), y.amin())), torch.stack((x.amax(), y.amax())) + 1.0))


def _carved(cameras: Cameras, alphas: Tensor, low: Tensor, high: Tensor) -> tuple[Tensor, Tensor]:
    """Centres (K, 3) of the cells of a grid whose centres every silhouette covers, and a cell's sides.

    What a picture does not frame it says nothing of; a cell that less than half of the pictures frame is left out.
    """
    axis = (torch.arange(GRID, dtype=torch.float64) + 0.5) / GRID
    unit = torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), dim=-1).reshape(-1, 3)
    points = low + unit * (high - low)
    framed = torch.zeros(len(points), dtype=torch.long)
    size = points.new_tensor((cameras.width, cameras.height))
    for view in range(len(alphas)):
        pixels, _, in_front = project_into_all(cameras[view : view + 1], points)
        at = 2.0 * pixels[:, 0] / size - 1.0
        seen = in_front[:, 0] & (at.abs() < 1.0).all(-1)
        covered = F.grid_sample(
            alphas[view][None, None], at[None, None], align_corners=False, padding_mode="border"
        )
        held = (covered[0, 0, 0] > INSIDE) | ~seen
        points, framed = points[held], (framed + seen)[held]
    return points[2 * framed >= len(alphas)], (high - low) / GRID
