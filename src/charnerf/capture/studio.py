"""Pictures of a surface by rays: RGBA and depth, antialiased, texture-filtered.

Letters: H, W of a picture; K pixels of it, or hits of rays.
"""

import math
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from scipy import ndimage

from charnerf.capture.lights import AbstractLight
from charnerf.geometry.cameras import project
from charnerf.geometry.world import CENTRE
from charnerf.surfaces.color import srgb_from_linear
from charnerf.surfaces.raycast import Hits, RayCaster
from charnerf.surfaces.surface_mesh import SurfaceMesh, shade, texture_levels, triangle_normals
from charnerf.types import Cameras

SUBSAMPLES = 9
EDGE_SUBSAMPLES = 36


@dataclass(frozen=True)
class Shot:
    """A picture: rgba uint8 (H, W, 4), depth uint16 (H, W) in mm."""

    rgba: np.ndarray
    depth: np.ndarray


@dataclass(frozen=True)
class _Sampling:
    """Rays a pixel, and the texture level (M,) at which each triangle is read by so many."""

    count: int
    levels: np.ndarray


@final
class Studio:
    """A surface made ready for pictures from many cameras.

    Args:
        surface: World frame.
        light: How it is lit.
        subsamples: Rays a pixel.
        edge_subsamples: Rays for each pixel that the silhouette crosses.
    """

    def __init__(
        self,
        surface: SurfaceMesh,
        light: AbstractLight,
        *,
        subsamples: int = SUBSAMPLES,
        edge_subsamples: int = EDGE_SUBSAMPLES,
    ) -> None:
        self._surface = surface
        self._light = light
        self._counts = (subsamples, edge_subsamples)
        self._caster = RayCaster.of_surface(surface)
        self._normals = triangle_normals(surface)

    def shoot(self, cameras: Cameras) -> list[Shot]:
        """Take pictures by cameras (N,) of one kind at one distance."""
        cameras = cameras.to(dtype=torch.float32)  # as Embree's rays are
        pixel = _pixel_size(cameras[0])
        spacing = 0.6 * pixel  # nearer parts appear up to 1.7 times larger
        edges = torch.from_numpy(_points_on_edges(self._surface.triangles, 0.5 * spacing).astype(np.float32))
        samplings = [
            _Sampling(count, texture_levels(self._surface, pixel / math.sqrt(count)))
            for count in self._counts
        ]
        return [
            self._picture(cameras[index], _touched_pixels(cameras[index], edges), *samplings)
            for index in range(len(cameras.orthographic))
        ]

    def _picture(
        self, camera: Cameras, near_edges: np.ndarray, sampling: _Sampling, edge_sampling: _Sampling
    ) -> Shot:
        """One picture, given the pixels (H, W) that an edge of a triangle may touch.

        A ray through every pixel's centre finds the large parts; whatever else touches a pixel has an edge of a
        triangle in it, so that pixels without either are empty and cost one ray.
        """
        height, width = camera.height, camera.width
        seen, depth = np.zeros((height, width), dtype=bool), np.zeros((height, width), np.uint16)
        rows, columns = np.nonzero(_filled_box(near_edges))
        rays = self._trace(camera, np.stack((columns, rows), axis=-1) + 0.5)
        hits, rows, columns = rays[rays.hit], rows[rays.hit], columns[rays.hit]
        seen[rows, columns] = True
        along = hits.distances * (hits.directions @ -camera.world_from_camera[:3, 2].numpy())
        depth[rows, columns] = np.clip(np.rint(1000.0 * along), 1, 65535).astype(np.uint16)

        rows, columns = np.nonzero(seen | near_edges)
        linear = self._supersample(camera, rows, columns, sampling)
        partial = (linear[:, 3] > 0.0) & (linear[:, 3] < 1.0)
        linear[partial] = self._supersample(camera, rows[partial], columns[partial], edge_sampling)
        rgba = np.zeros((height, width, 4), np.uint8)
        rgba[rows, columns] = _encode(linear)
        return Shot(rgba=rgba, depth=depth)

    def _trace(self, camera: Cameras, pixels: np.ndarray) -> Hits:
        """Hits of rays through pixel positions (R, 2)."""
        return self._caster.pixel_hits(camera, torch.from_numpy(pixels.astype(np.float32)))

    def _supersample(
        self, camera: Cameras, rows: np.ndarray, columns: np.ndarray, sampling: _Sampling
    ) -> np.ndarray:
        """Linear RGBA (K, 4) of pixels (K,): mean colour of what is hit, alpha the share that is hit."""
        count, number = sampling.count, len(rows)
        pixels = np.stack((columns, rows), axis=-1)[:, None] + _lattice(count)
        rays = self._trace(camera, pixels.reshape(-1, 2))
        hits = rays[rays.hit]
        colors = shade(self._surface, hits.triangles, hits.u, hits.v, sampling.levels)[:, :3]
        colors = self._light.lit(colors, self._normals[hits.triangles], hits.directions)
        pixel_of = np.flatnonzero(rays.hit) // count
        total = np.bincount(pixel_of, minlength=number)
        sums = [np.bincount(pixel_of, weights=channel, minlength=number) for channel in colors.T]
        rgb = np.stack(sums, axis=-1) / np.maximum(total, 1)[:, None]
        return np.concatenate((rgb, (total / count)[:, None]), axis=-1)


def _touched_pixels(camera: Cameras, points: torch.Tensor) -> np.ndarray:
    """Pixels (H, W) that points (P, 3) project into, and their neighbours."""
    pixels, _, in_front = project(camera, points)
    indices = torch.floor(pixels[in_front]).long()
    columns = indices[:, 0].clamp(0, camera.width - 1)
    rows = indices[:, 1].clamp(0, camera.height - 1)
    touched = np.zeros((camera.height, camera.width), dtype=bool)
    touched[rows.numpy(), columns.numpy()] = True
    return ndimage.binary_dilation(touched, structure=np.ones((3, 3), dtype=bool))


def _lattice(count: int) -> np.ndarray:
    """Points (count, 2) evenly over the unit square, no two in one column: thin parts are not missed."""
    index = np.arange(count) + 0.5
    return np.stack((index / count, index * (math.sqrt(5.0) - 1.0) / 2.0 % 1.0), axis=-1)


def _pixel_size(camera: Cameras) -> float:
    """Side of a pixel at the character's centre, m, to four digits: cameras at one distance share it."""
    distance = 1.0
    if not bool(camera.orthographic):
        distance = float(np.linalg.norm(camera.world_from_camera[:3, 3].numpy() - np.array(CENTRE)))
    return float(f"{distance / float(camera.focal[0]):.4g}")


def _points_on_edges(triangles: np.ndarray, spacing: float) -> np.ndarray:
    """Points (n, 3), float64, so that none of the triangles' edges is farther than the spacing from one."""
    starts = triangles.reshape(-1, 3).astype(np.float64)
    ends = np.roll(triangles, -1, axis=1).reshape(-1, 3).astype(np.float64)
    lengths = np.linalg.norm(ends - starts, axis=-1)
    counts = np.maximum(np.ceil(lengths / spacing), 1).astype(np.int64)  # ends are the starts of others
    edge = np.repeat(np.arange(len(starts)), counts)
    first = np.cumsum(counts) - counts
    share = (np.arange(len(edge)) - first[edge]) / counts[edge]
    points = starts[edge] + share[:, None] * (ends - starts)[edge]
    cells = np.floor(points / spacing).astype(np.int64)
    cells -= cells.min(axis=0)
    shape = cells.max(axis=0) + 1
    keys = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    return points[np.unique(keys, return_index=True)[1]]


def _filled_box(mask: np.ndarray) -> np.ndarray:
    """The bounding box of what is set, as a mask."""
    box = np.zeros_like(mask)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows):
        box[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] = True
    return box


def _encode(linear: np.ndarray) -> np.ndarray:
    """uint8 sRGB with straight alpha (K, 4) of linear RGBA."""
    rgba = np.concatenate((srgb_from_linear(linear[:, :3]), linear[:, 3:]), axis=-1)
    return np.rint(255.0 * rgba).astype(np.uint8)
