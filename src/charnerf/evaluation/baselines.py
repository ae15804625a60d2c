"""What a user has without any learning: a white sheet, and the carved and coloured silhouettes.

`VisualHullBaseline` carves on a grid whose values are the signed distance to the nearest mask edge, so that
its marching cubes are smooth, renders by Embree with 2x2 rays a pixel, and colours every hit from the
source view nearest to the target camera that sees the point. Letters: N views, R rays, K hits.
"""

from typing import final

import numpy as np
import torch
import trimesh
from scipy.ndimage import distance_transform_edt
from skimage.measure import marching_cubes
from torch import Tensor

from charnerf.evaluation.ray_mesh import RayMesh
from charnerf.geometry.cameras import pixel_centres, pixel_rays, project
from charnerf.geometry.safe import safe_normalize
from charnerf.types import Cameras, RenderOutput, SourceViews

_BOX_CENTRE = (0.0, 0.0, 1.0)
_BOX_HALF_EXTENT = 1.8
_COARSE_CELL = 0.06
_FINE_CELL = 0.012
_MAX_CELLS = 3_000_000
_OVERSAMPLING = 2
_FAR = 10.0
_MIN_FACING = 0.15
"""Cosine below which a view grazes the surface: its colours would be the streaks of the silhouette's edge."""
_RAY_OFFSET = 0.015
"""How far a shadow ray starts off the surface, m: about one grid cell."""


def white_prediction(camera: Cameras) -> RenderOutput:
    """The picture that ignores its drawings: white, nothing there, (H, W)."""
    device = camera.world_from_camera.device
    shape = (camera.height, camera.width)
    return RenderOutput(
        rgb=torch.ones(*shape, 3, device=device),
        opacity=torch.zeros(*shape, device=device),
        depth=torch.full(shape, _FAR, device=device),
    )


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


def _look_up(maps: Tensor, pixels: Tensor) -> Tensor:
    """Bilinear values (P, C) of maps (C, H, W) at pixels (P, 2); the edge's value outside."""
    height, width = maps.shape[-2:]
    grid = 2.0 * pixels / pixels.new_tensor((width, height)) - 1.0
    values = torch.nn.functional.grid_sample(
        maps[None], grid[None, None], mode="bilinear", padding_mode="border", align_corners=False
    )
    return values[0, :, 0].T


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
        signed = _look_up(edge_distances[view][None], pixels)[:, 0]
        signed = torch.where(outside > 0.0, torch.minimum(signed, -outside), signed)
        pixel = 1.0 / cameras.focal[view].mean()
        if not bool(cameras.orthographic[view]):
            pixel = pixel * depth.clamp_min(1e-3)
        field = torch.minimum(field, torch.where(in_front, signed * pixel, -torch.ones_like(signed)))
    return field


def _grid_points(low: Tensor, cell: float, counts: tuple[int, int, int]) -> Tensor:
    """Points of a grid, (prod(counts), 3)."""
    axes = [low[axis] + cell * torch.arange(counts[axis]) for axis in range(3)]
    return torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1).reshape(-1, 3)


def carve(cameras: Cameras, edge_distances: Tensor) -> trimesh.Trimesh | None:
    """Mesh of the visual hull of views (V,) with signed edge distances (V, H, W); None if it is empty."""
    centre = torch.tensor(_BOX_CENTRE)
    count = 1 + int(2 * _BOX_HALF_EXTENT / _COARSE_CELL)
    coarse = _grid_points(centre - _BOX_HALF_EXTENT, _COARSE_CELL, (count, count, count))
    near = hull_field(cameras, edge_distances, coarse) > -_COARSE_CELL
    if not bool(near.any()):
        return None
    low = coarse[near].amin(0) - _COARSE_CELL
    extent = coarse[near].amax(0) + _COARSE_CELL - low
    cell = max(_FINE_CELL, float(extent.prod() / _MAX_CELLS) ** (1 / 3))
    counts = tuple(int(side / cell) + 2 for side in extent.tolist())
    assert len(counts) == 3
    field = hull_field(cameras, edge_distances, _grid_points(low, cell, counts)).reshape(counts)
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
        used = (sources.present & ~sources.mirrored)[0]
        self._cameras: Cameras = sources.cameras[0][used].to("cpu", torch.float32)
        images = sources.images[0][used].to("cpu", torch.float32)
        self._premultiplied = torch.cat((images[:, :3] * images[:, 3:], images[:, 3:]), dim=1)  # (V, 4, H, W)
        self.mesh = carve(self._cameras, signed_edge_distances(images[:, 3]))
        if self.mesh is not None:
            self._rays = RayMesh(self.mesh.vertices, self.mesh.faces)
            self._normals = np.asarray(self.mesh.face_normals, dtype=np.float32)

    def render(self, camera: Cameras) -> RenderOutput:
        """Picture of a camera of shape (): fields (H, W), on white."""
        if self.mesh is None:
            return white_prediction(camera)
        width, height, many = camera.width, camera.height, _OVERSAMPLING
        rays = pixel_rays(camera.to("cpu", torch.float32), pixel_centres(width * many, height * many) / many)
        origins, directions = (tensor.reshape(-1, 3).numpy() for tensor in (rays.origins, rays.directions))
        hits = self._rays.first_hits(origins, directions)
        towards = camera.world_from_camera[:3, 2].to("cpu", torch.float32)
        colours = self._colours(
            torch.from_numpy(hits.points), torch.from_numpy(self._normals[hits.triangles]), towards
        )
        fine = torch.zeros(len(origins), 5)
        index = torch.from_numpy(hits.rays)
        fine[index] = torch.cat(
            (colours, torch.ones(len(index), 1), torch.from_numpy(hits.distances)[:, None]), dim=1
        )
        mean = fine.reshape(height, many, width, many, 5).mean(dim=(1, 3))
        opacity = mean[..., 3]
        seen = opacity > 0.0
        depth = torch.where(seen, mean[..., 4] / torch.where(seen, opacity, 1.0), _FAR)
        return RenderOutput(rgb=mean[..., :3] + (1.0 - opacity)[..., None], opacity=opacity, depth=depth)

    def _colours(self, points: Tensor, normals: Tensor, towards: Tensor) -> Tensor:
        """Colours (K, 3) of surface points (K, 3) with normals (K, 3), for a camera in a direction (3,)."""
        choice = self._choose_views(points, normals, towards)
        colours = torch.zeros(len(points), 3)
        for view, camera_maps in enumerate(self._premultiplied):
            chosen = choice == view
            pixels, _, _ = project(self._cameras[view], points[chosen])
            value = _look_up(camera_maps, pixels)
            colours[chosen] = (value[:, :3] / value[:, 3:].clamp_min(1e-3)).clamp(0.0, 1.0)
        return colours

    def _choose_views(self, points: Tensor, normals: Tensor, towards: Tensor) -> Tensor:
        """Which source view colours each point, (K,): the nearest to the camera of those that see it.

        A point that none sees takes the view that faces its surface most squarely, from either side: the
        far side of the side drawing is a better guess than the streaks of an edge.
        """
        scores = []
        for view in range(len(self._premultiplied)):
            pose = self._cameras.world_from_camera[view]
            axis = pose[:3, 2]
            if bool(self._cameras.orthographic[view]):
                to_source = axis.expand_as(points)
            else:
                to_source = safe_normalize(pose[:3, 3] - points)
            facing = (normals * to_source).sum(-1)
            seen = facing > _MIN_FACING
            starts = points[seen] + _RAY_OFFSET * normals[seen]
            free = ~self._rays.occluded(starts.numpy(), to_source[seen].numpy())
            seen[seen.clone()] = torch.from_numpy(free)
            scores.append(torch.where(seen, 10.0 + axis @ towards, facing.abs()))
        return torch.stack(scores).argmax(dim=0)
