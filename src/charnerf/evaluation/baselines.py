"""What a user has without any learning: a white sheet, and the carved and coloured silhouettes.

`VisualHullBaseline` carves on a grid whose values are the signed distance to the nearest mask edge, so that
its marching cubes are smooth, and colours the surface from the drawings (evaluation/projected.py).
"""

from typing import final

import numpy as np
import torch
import trimesh
from scipy.ndimage import distance_transform_edt
from skimage.measure import marching_cubes
from torch import Tensor

from charnerf.evaluation.projected import FAR, ProjectedMesh, look_up
from charnerf.geometry.cameras import project, world_axis_along
from charnerf.geometry.world import BOX_HALF_EXTENT, CENTRE
from charnerf.types import Cameras, RenderOutput, SourceViews

_COARSE_CELL = 0.06
_FINE_CELL = 0.012
_MAX_CELLS = 3_000_000
_POINTS_AT_ONCE = 65_536  # 3 MiB a tensor; all at once would take 500 MiB


def white_prediction(camera: Cameras) -> RenderOutput:
    """The picture that ignores its drawings: white, nothing there, (H, W)."""
    device = camera.world_from_camera.device
    shape = (camera.height, camera.width)
    return RenderOutput(
        rgb=torch.ones(*shape, 3, device=device),
        opacity=torch.zeros(*shape, device=device),
        depth=torch.full(shape, FAR, device=device),
    )


def used_drawings(sources: SourceViews) -> tuple[Cameras, Tensor]:
    """Cameras (V,) and images (V, 4, H, W) of the views that are there and not mirrored, B = 1, on the CPU."""
    used = (sources.present & ~sources.mirrored)[0]
    return sources.cameras[0][used].to("cpu", torch.float32), sources.images[0][used].to("cpu", torch.float32)


def signed_edge_distances(alphas: Tensor) -> Tensor:
    """Distance of pixel centres from the contour alpha = 0.5, pixels, positive inside, (..., H, W).

    Pixels beside the contour take alpha - 0.5: antialiased edges are kept to a fraction of a pixel.
    """
    flat = alphas.reshape(-1, *alphas.shape[-2:]).cpu().numpy()
    distances = []
    for alpha in flat:
        inside = np.pad(alpha > 0.5, 1)
        signed = distance_transform_edt(inside) - distance_transform_edt(~inside)
        signed = (np.abs(signed) - 0.5)[1:-1, 1:-1] * np.sign(signed)[1:-1, 1:-1]
        distances.append(np.where(np.abs(signed) < 0.6, alpha - 0.5, signed))
    return torch.from_numpy(np.stack(distances)).float().reshape(alphas.shape)


def hull_field(cameras: Cameras, edge_distances: Tensor, points: Tensor) -> Tensor:
    """Smooth field (P,), m, whose zero is the visual hull: the smallest signed distance to a mask's edge.

    Args:
        cameras: The views' cameras, (V,).
        edge_distances: (V, H, W), pixels, positive inside.
        points: (P, 3), m.
    """
    size = points.new_tensor((cameras.width, cameras.height))
    field = torch.full(points.shape[:-1], torch.inf)
    for view in range(len(edge_distances)):
        pixels, depth, in_front = project(cameras[view], points)
        outside = (pixels - torch.minimum(pixels.clamp_min(0.0), size)).norm(dim=-1)
        signed = look_up(edge_distances[view][None], pixels)[:, 0]
        signed = torch.where(outside > 0.0, torch.minimum(signed, -outside), signed)
        pixel = 1.0 / cameras.focal[view].mean()
        if not bool(cameras.orthographic[view]):
            pixel = pixel * depth.clamp_min(1e-3)
        field = torch.minimum(field, torch.where(in_front, signed * pixel, -torch.ones_like(signed)))
    return field


def _in_chunks(cameras: Cameras, edge_distances: Tensor, points: Tensor) -> Tensor:
    """`hull_field` of so many points (P, 3) that all at once would fill the memory."""
    return torch.cat([hull_field(cameras, edge_distances, part) for part in points.split(_POINTS_AT_ONCE)])


def grid_field(
    cameras: Cameras, edge_distances: Tensor, low: Tensor, cell: float, counts: tuple[int, int, int]
) -> Tensor:
    """`hull_field` of all points low + cell * index of a grid, (counts): of a view along one of its axes one layer says all.

    Args:
        cameras: The views' cameras, (V,).
        edge_distances: (V, H, W), pixels, positive inside.
        low: The grid's first point, (3,), m.
        cell: m.
        counts: Points along the axes.
    """
    ends = torch.stack((low, low + cell * (torch.tensor(counts) - 1)))
    field = torch.full(counts, torch.inf)
    for view in range(len(edge_distances)):
        along = world_axis_along(cameras[view], ends)
        x, y, z = (1 if axis == along else count for axis, count in enumerate(counts))
        one = slice(view, view + 1)
        values = _in_chunks(cameras[one], edge_distances[one], _grid_points(low, cell, (x, y, z)))
        field = torch.minimum(field, values.view(x, y, z))
    return field


def _grid_points(low: Tensor, cell: float, counts: tuple[int, int, int]) -> Tensor:
    """Points of a grid, (prod(counts), 3)."""
    axes = [low[axis] + cell * torch.arange(counts[axis]) for axis in range(3)]
    return torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1).reshape(-1, 3)


def carve(cameras: Cameras, edge_distances: Tensor) -> trimesh.Trimesh | None:
    """Mesh of the visual hull of views (V,) with signed edge distances (V, H, W); None if it is empty."""
    centre = torch.tensor(CENTRE)
    count = 1 + int(2 * BOX_HALF_EXTENT / _COARSE_CELL)
    shape = (count, count, count)
    coarse = _grid_points(centre - BOX_HALF_EXTENT, _COARSE_CELL, shape)
    near = grid_field(cameras, edge_distances, coarse[0], _COARSE_CELL, shape).reshape(-1) > -_COARSE_CELL
    if not bool(near.any()):
        return None
    low = coarse[near].amin(0) - _COARSE_CELL
    extent = coarse[near].amax(0) + _COARSE_CELL - low
    cell = max(_FINE_CELL, float(extent.prod() / _MAX_CELLS) ** (1 / 3))
    counts = tuple(int(side / cell) + 2 for side in extent.tolist())
    assert len(counts) == 3
    field = grid_field(cameras, edge_distances, low, cell, counts)
    solid = np.pad(field.numpy(), 1, constant_values=-cell)
    if not (solid > 0.0).any():
        return None
    vertices, faces, _, _ = marching_cubes(solid, level=0.0, spacing=(cell,) * 3, gradient_direction="ascent")
    return trimesh.Trimesh(vertices + (low - cell).numpy(), faces, process=False)


@final
class VisualHullBaseline:
    """The carved and coloured silhouettes of one character.

    Args:
        sources: Its drawings, B = 1; absent and mirrored views are not used.
    """

    def __init__(self, sources: SourceViews) -> None:
        cameras, images = used_drawings(sources)
        premultiplied = torch.cat((images[:, :3] * images[:, 3:], images[:, 3:]), dim=1)
        self.mesh = carve(cameras, signed_edge_distances(images[:, 3]))
        if self.mesh is not None:
            self._projected = ProjectedMesh(self.mesh.triangles, cameras, premultiplied)

    def render(self, camera: Cameras) -> RenderOutput:
        """Picture of a camera of shape (): fields (H, W), on white."""
        return white_prediction(camera) if self.mesh is None else self._projected.render(camera)
