"""A mesh coloured by drawings: rendered by Embree with 2x2 rays a pixel, every hit coloured from one source view.

That is the view nearest to the target camera that sees the point. Letters: M triangles, V views, R rays, K hits.
"""

from typing import final

import numpy as np
import torch
from torch import Tensor

from charnerf.geometry.cameras import pixel_centres, project
from charnerf.geometry.safe import safe_normalize
from charnerf.surfaces.raycast import RayCaster
from charnerf.types import Cameras, RenderOutput

FAR = 10.0
"""Depth of a pixel that shows nothing, m."""
_OVERSAMPLING = 2
_MIN_FACING = 0.15
"""Cosine below which a view grazes the surface: its colours would be the streaks of the silhouette's edge."""
_RAY_OFFSET = 0.015
"""How far a shadow ray starts off the surface, m: about one cell of a visual hull's grid."""


def look_up(maps: Tensor, pixels: Tensor) -> Tensor:
    """Bilinear values (P, C) of maps (C, H, W) at pixels (P, 2); the edge's value outside."""
    height, width = maps.shape[-2:]
    grid = 2.0 * pixels / pixels.new_tensor((width, height)) - 1.0
    values = torch.nn.functional.grid_sample(
        maps[None], grid[None, None], mode="bilinear", padding_mode="border", align_corners=False
    )
    return values[0, :, 0].T


@final
class ProjectedMesh:
    """A surface that shows what the drawings show there.

    Args:
        triangles: Corners, (M, 3, 3), world frame, m; either side may face outwards.
        cameras: Of the drawings, (V,), float32 on the CPU.
        premultiplied: The drawings, (V, 4, H, W), colours times alpha and alpha, in [0, 1].
    """

    def __init__(self, triangles: np.ndarray, cameras: Cameras, premultiplied: Tensor) -> None:
        corners = np.asarray(triangles, dtype=np.float32)
        self._caster = RayCaster(corners)
        sides = torch.from_numpy(corners[:, 1:] - corners[:, :1])
        self._normals = safe_normalize(torch.linalg.cross(sides[:, 0], sides[:, 1])).numpy()
        self._cameras = cameras
        self._premultiplied = premultiplied

    def render(self, camera: Cameras) -> RenderOutput:
        """Picture of a camera of shape (): fields (H, W), on white."""
        width, height, many = camera.width, camera.height, _OVERSAMPLING
        pixels = (pixel_centres(width * many, height * many) / many).reshape(-1, 2)
        rays = self._caster.pixel_hits(camera, pixels)
        hits = rays[rays.hit]
        towards = camera.world_from_camera[:3, 2].to("cpu", torch.float32)
        normals = self._normals[hits.triangles]
        away = (normals * hits.directions).sum(-1, keepdims=True) > 0.0
        normals = np.where(away, -normals, normals)  # of the side that is seen
        colors = self._colors(torch.from_numpy(hits.points), torch.from_numpy(normals), towards)
        fine = torch.zeros(len(pixels), 5)
        fine[torch.from_numpy(rays.hit)] = torch.cat(
            (colors, torch.ones(len(colors), 1), torch.from_numpy(hits.distances)[:, None]), dim=1
        )
        mean = fine.reshape(height, many, width, many, 5).mean(dim=(1, 3))
        opacity = mean[..., 3]
        seen = opacity > 0.0
        depth = torch.where(seen, mean[..., 4] / torch.where(seen, opacity, 1.0), FAR)
        return RenderOutput(rgb=mean[..., :3] + (1.0 - opacity)[..., None], opacity=opacity, depth=depth)

    def _colors(self, points: Tensor, normals: Tensor, towards: Tensor) -> Tensor:
        """Colours (K, 3) of surface points (K, 3) with normals (K, 3), for a camera in a direction (3,)."""
        choice = self._choose_views(points, normals, towards)
        colors = torch.zeros(len(points), 3)
        for view, camera_maps in enumerate(self._premultiplied):
            chosen = choice == view
            pixels, _, _ = project(self._cameras[view], points[chosen])
            value = look_up(camera_maps, pixels)
            colors[chosen] = (value[:, :3] / value[:, 3:].clamp_min(1e-3)).clamp(0.0, 1.0)
        return colors

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
            free = ~self._caster.occluded(starts.numpy(), to_source[seen].numpy())
            seen[seen.clone()] = torch.from_numpy(free)
            scores.append(torch.where(seen, 10.0 + axis @ towards, facing.abs()))
        return torch.stack(scores).argmax(dim=0)
