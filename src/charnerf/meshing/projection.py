"""Colours of surface points from the drawings that see them.

A drawing sees a point if nothing of the mesh lies in between and the surface faces it. Only pixels well
inside a figure's outline are believed: the others, which mix with the background or belong to something that
hides the point, take the colour of the nearest believed one. Views are blended in two bands: smooth colour
widely, so that drawings of unequal brightness meet without a seam, detail narrowly, so that it is not
doubled.

Letters: K points, V views, H, W image height and width.
Source: Burt and Adelson 1983 (bands); Baumberg 2002 (two bands for textures of photographed objects).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
import torch
import trimesh
from scipy import ndimage
from torch import Tensor

from charnerf.geometry.cameras import directions_to_points, pixel_centres, pixel_rays, project
from charnerf.pictures import read_bilinear
from charnerf.surfaces.raycast import RayCaster
from charnerf.types import Cameras, SourceViews

OPAQUE = 0.9  # alpha from which a pixel is the figure's alone
EDGE = 0.006  # metres, or 1.5 pixels if that is more: so far inside its outline a figure is believed
SMOOTH = 0.04  # metres: standard deviation of the smooth band
BESIDE = 0.012  # metres, or one pixel if that is more: so near to an occluder's outline a point is doubted
BEHIND = 0.04  # metres that a point must lie behind an occluder to be doubted
IN_FRONT = 0.01  # metres in front of a point that still are the point: bumps of the surface
LEAST_COSINE = 0.05  # flatter than this a drawing shows streaks
DOUBTED = 0.3  # weight of what is doubted, beside 1
WIDE, NARROW = 3, 12  # powers of the cosine that weigh views in the smooth and in the fine band
DEPTH_SIZE = 512  # pixels a side, at most, of the maps of depth


@dataclass(frozen=True)
class Drawn:
    """What drawings say of points.

    Attributes:
        rgb: (K, 3), sRGB-encoded; zero where no drawing sees the point.
        smooth: The smooth band alone, (K, 3).
        trust: How well the point is seen, (K,): the cosine of the best view, less where doubted, 0 unseen.
    """

    rgb: np.ndarray
    smooth: np.ndarray
    trust: np.ndarray


@dataclass(frozen=True)
class _Drawing:
    """A drawing made ready to be read.

    Attributes:
        camera: Its camera, shape (), float32.
        smooth: Its smooth band, (H, W, 3), continued beyond what is believed.
        fine: Its fine band, likewise.
        believed: Pixels that show the figure alone, (H, W), bool.
        occluder_depth: Least depth of the mesh near each place of the picture, (h, w), m.
    """

    camera: Cameras
    smooth: np.ndarray
    fine: np.ndarray
    believed: np.ndarray
    occluder_depth: np.ndarray


@dataclass(frozen=True)
class _Reading:
    """What one drawing says of the points that it sees: index, cosine, belief (L,), smooth and fine band (L, 3)."""

    index: np.ndarray
    cosine: np.ndarray
    belief: np.ndarray
    smooth: np.ndarray
    fine: np.ndarray


@final
class Projector:
    """Drawings and a mesh, ready to colour points of the mesh.

    Args:
        views: The drawings, B = 1; absent and mirrored views are not used.
        mesh: The surface, world frame.
    """

    def __init__(self, views: SourceViews, mesh: trimesh.Trimesh) -> None:
        used = (views.present & ~views.mirrored)[0]
        cameras = views.cameras[0][used].to("cpu", torch.float32)
        images = views.images[0][used].to("cpu", torch.float32).movedim(1, -1).numpy()
        self._caster = RayCaster(mesh.triangles)
        self._drawings = [
            _Drawing(
                cameras[view],
                *_bands(image, _pixels_a_metre(cameras[view])),
                _occluder_depth(self._caster, cameras[view]),
            )
            for view, image in enumerate(images)
        ]

    def at(self, points: np.ndarray, normals: np.ndarray, face: np.ndarray) -> Drawn:
        """Colours of points of the mesh.

        Args:
            points: (K, 3), m.
            normals: Outward, (K, 3).
            face: Triangles that the points lie on, (K,).
        """
        fine, smooth = np.zeros((len(points), 3)), np.zeros((len(points), 3))
        fine_sum, smooth_sum, trust = (np.zeros(len(points)) for _ in range(3))
        for drawing in self._drawings:
            read = self._read(drawing, np.asarray(points), normals, face)
            narrow, wide = read.belief * read.cosine**NARROW, read.belief * read.cosine**WIDE
            fine[read.index] += narrow[:, None] * read.fine
            smooth[read.index] += wide[:, None] * read.smooth
            fine_sum[read.index] += narrow
            smooth_sum[read.index] += wide
            trust[read.index] = np.maximum(trust[read.index], read.belief * read.cosine)
        smooth /= np.where(smooth_sum > 0, smooth_sum, 1.0)[:, None]
        fine /= np.where(fine_sum > 0, fine_sum, 1.0)[:, None]
        return Drawn((smooth + fine).clip(0.0, 1.0), smooth, trust)

    def _read(self, drawing: _Drawing, points: np.ndarray, normals: np.ndarray, face: np.ndarray) -> _Reading:
        camera = drawing.camera
        tensor = torch.from_numpy(points.astype(np.float32))
        directions = directions_to_points(camera[None], tensor)[:, 0].numpy()
        cosine = -(normals * directions).sum(1)
        pixels, depth, in_front = project(camera, tensor)
        framed = in_front & ((pixels >= 0) & (pixels <= _size_of(camera))).all(-1)
        index = np.flatnonzero((cosine > LEAST_COSINE) & framed.numpy())
        index = index[self._sees(camera, pixels[index], points[index], face[index])]
        at = pixels[index].numpy()
        belief = np.where(_nearest(drawing.believed, at, camera), 1.0, DOUBTED)
        before = _nearest(drawing.occluder_depth, at, camera) < depth[index].numpy() - BEHIND
        return _Reading(
            index=index,
            cosine=cosine[index],
            belief=np.where(before, DOUBTED * belief, belief),
            smooth=read_bilinear(drawing.smooth, at),
            fine=read_bilinear(drawing.fine, at),
        )

    def _sees(self, camera: Cameras, pixels: Tensor, points: np.ndarray, face: np.ndarray) -> np.ndarray:
        """Whether the ray through each pixel position meets its point (K, 3) first, (K,) bool."""
        rays = pixel_rays(camera, pixels)
        origins, directions = rays.origins.numpy(), rays.directions.numpy()
        distances = ((points - origins) * directions).sum(1)
        return self._caster.reaches(
            origins, directions, triangles=face, distances=distances, tolerance=IN_FRONT
        )


def _occluder_depth(caster: RayCaster, camera: Cameras) -> np.ndarray:
    """Least depth of a mesh within BESIDE of each place of a picture, (h, w), m; infinite where nothing is."""
    share = min(1.0, DEPTH_SIZE / max(camera.width, camera.height))
    width, height = round(camera.width * share), round(camera.height * share)
    scale = torch.tensor((camera.width / width, camera.height / height))
    hits = caster.pixel_hits(camera, pixel_centres(width, height).reshape(-1, 2) * scale)
    axis = -camera.world_from_camera[:3, 2].numpy()
    centre = camera.world_from_camera[:3, 3].numpy()
    depth = (hits.origins - centre) @ axis + hits.distances * (hits.directions @ axis)
    reach = max(1, round(BESIDE * _pixels_a_metre(camera) * share))
    return ndimage.minimum_filter(depth.reshape(height, width), size=2 * reach + 1, mode="nearest")


def _bands(image: np.ndarray, pixels_a_metre: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smooth and fine band and what is believed, as of `_Drawing`, of a picture (H, W, 4)."""
    opaque = image[..., 3] > OPAQUE
    if not opaque.any():
        opaque = image[..., 3] >= image[..., 3].max()
    depth = ndimage.distance_transform_edt(np.pad(opaque, 1))[1:-1, 1:-1]
    ridge = opaque & (depth >= ndimage.maximum_filter(depth, size=3))  # thin parts keep their middle
    edge = int(EDGE * pixels_a_metre)
    believed = (depth > edge + 0.5) | ridge  # the half takes diagonal neighbours of the background, too
    nearest = tuple(ndimage.distance_transform_edt(~believed, return_distances=False, return_indices=True))
    rgb = image[..., :3].astype(np.float64)
    sigma = max(1.0, SMOOTH * pixels_a_metre)
    share = ndimage.gaussian_filter(believed.astype(np.float64), sigma)
    blurred = [ndimage.gaussian_filter(rgb[..., c] * believed, sigma) for c in range(3)]
    smooth = np.stack(blurred, axis=-1) / np.maximum(share, 1e-12)[..., None]
    fine = np.stack([_between(band) for band in np.moveaxis((rgb - smooth)[nearest], -1, 0)], axis=-1)
    return smooth[nearest], fine, believed


def _between(band: np.ndarray) -> np.ndarray:
    """Values (H, W) at pixel centres so that the mean over each pixel, read bilinearly, is the one given.

    Hat functions averaged over a pixel are the quadratic spline at whole numbers, whose inverse filter is
    known. Without, reading between pixels would blur what the texture shows.
    """
    return np.asarray(ndimage.spline_filter(band, order=2, mode="nearest"))


def _pixels_a_metre(camera: Cameras) -> float:
    """Of an orthographic camera exactly, of a pinhole at the axis of the world."""
    focal = float(camera.focal.mean())
    return focal if bool(camera.orthographic) else focal / float(camera.world_from_camera[:3, 3].norm())


def _size_of(camera: Cameras) -> Tensor:
    return torch.tensor((camera.width, camera.height), dtype=torch.float32)


def _nearest(values: np.ndarray, pixels: np.ndarray, camera: Cameras) -> np.ndarray:
    """Values (K,) of a map (h, w) that spans the camera's picture, at pixels (K, 2)."""
    height, width = values.shape
    column = (pixels[:, 0] * (width / camera.width)).astype(np.int64).clip(0, width - 1)
    row = (pixels[:, 1] * (height / camera.height)).astype(np.int64).clip(0, height - 1)
    return values[row, column]
