"""Pictures of a scene by Embree rays: RGBA, antialiased, texture-filtered, unlit by default."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import torch
import trimesh
from scipy import ndimage

from charnerf.capture.lights import AbstractLight, Unlit
from charnerf.data.characters import CharacterPictures
from charnerf.errors import ConfigError
from charnerf.geometry.cameras import fibonacci_hemisphere, project
from charnerf.geometry.framing import CENTRE, SOURCE_ORDER, framing_cameras, source_cameras
from charnerf.surfaces.color import srgb_from_linear
from charnerf.surfaces.raycast import Hits, RayCaster
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import SurfaceMesh, shade, texture_levels, triangle_normals
from charnerf.types import Cameras


@dataclass(frozen=True)
class CaptureOptions:
    """How a character is captured.

    Attributes:
        views: Target pictures, on a Fibonacci lattice of the upper hemisphere.
        size: Side of every picture, pixels.
        sources: Projection of the source views.
        depth: Whether to keep depth pictures.
        light: How the surface is lit.
        subsamples: Rays a pixel.
        edge_subsamples: Rays for each pixel that the silhouette crosses.
    """

    views: int = 48
    size: int = 128
    sources: Literal["orthographic", "pinhole"] = "orthographic"
    depth: bool = False
    light: AbstractLight = field(default_factory=Unlit)
    subsamples: int = 9
    edge_subsamples: int = 36

    def __post_init__(self) -> None:
        """Check the options.

        Raises:
            ConfigError: If one is out of its range.
        """
        for name, least in (("views", 1), ("size", 8), ("subsamples", 1), ("edge_subsamples", 1)):
            if getattr(self, name) < least:
                raise ConfigError(f"{name}: found {getattr(self, name)}, expected at least {least}.")
        if self.sources not in ("orthographic", "pinhole"):
            raise ConfigError(f"sources: found {self.sources!r}, expected 'orthographic' or 'pinhole'.")


@dataclass(frozen=True)
class CapturedCharacter:
    """Pictures and cameras of a character, and the surface that they were taken of."""

    pictures: CharacterPictures
    surface: SurfaceMesh


def capture_character(
    scene: trimesh.Scene | trimesh.Trimesh | SurfaceMesh, options: CaptureOptions
) -> CapturedCharacter:
    """Take all pictures of a scene that stands in the world frame.

    Args:
        scene: World frame, from `meshes.load_scene` or a generator; or its surface.
        options: How.

    Returns:
        Pictures with their cameras: pinhole targets, and the source views front, side, back.

    Raises:
        DataError: If the scene has no triangles.
    """
    surface = scene if isinstance(scene, SurfaceMesh) else surface_of_scene(scene)
    radius, size = surface.framing_radius, options.size
    targets = framing_cameras(fibonacci_hemisphere(options.views), radius=radius, size=size)
    sources = source_cameras(radius=radius, size=size, orthographic=options.sources == "orthographic")
    studio = _Studio(surface, options)
    shots = [studio.shoot(camera) for camera in _each(targets)]
    source_shots = [studio.shoot(camera) for camera in _each(sources)]
    pictures = CharacterPictures(
        cameras=targets,
        images=np.stack([shot.rgba for shot in shots]),
        source_cameras=sources,
        source_images=np.stack([shot.rgba for shot in source_shots]),
        source_names=SOURCE_ORDER,
        depths=np.stack([shot.depth for shot in shots]) if options.depth else None,
    )
    return CapturedCharacter(pictures=pictures, surface=surface)


def capture_sources(surface: SurfaceMesh, size: int) -> np.ndarray:
    """Orthographic source views of a surface, front, side and back, RGBA uint8 (3, size, size, 4)."""
    studio = _Studio(surface, CaptureOptions())
    cameras = source_cameras(radius=surface.framing_radius, size=size)
    return np.stack([studio.shoot(camera).rgba for camera in _each(cameras)])


def _each(cameras: Cameras) -> Iterator[Cameras]:
    """One camera of shape () after the other, float32 as Embree's rays are."""
    for index in range(len(cameras.orthographic)):
        yield cameras[index].to(dtype=torch.float32)


@dataclass(frozen=True)
class _Shot:
    """A picture: rgba uint8 (H, W, 4), depth uint16 (H, W) in mm."""

    rgba: np.ndarray
    depth: np.ndarray


class _Studio:
    """A surface made ready for pictures from many cameras."""

    def __init__(self, surface: SurfaceMesh, options: CaptureOptions):
        self._surface = surface
        self._options = options
        self._caster = RayCaster.of_surface(surface)
        self._normals = triangle_normals(surface)
        self._levels: dict[float, np.ndarray] = {}
        self._outline: dict[float, torch.Tensor] = {}

    def shoot(self, camera: Cameras) -> _Shot:
        """Take one picture; camera of shape ().

        A ray through every pixel's centre finds the large parts; whatever else touches a pixel has an edge
        of a triangle in it,
        so that pixels without either are empty and cost one ray.
        """
        height, width = camera.height, camera.width
        seen, depth = np.zeros((height, width), dtype=bool), np.zeros((height, width), np.uint16)
        near_edges = self._edge_pixels(camera)
        rows, columns = np.nonzero(_filled_box(near_edges))
        rays = self._trace(camera, np.stack((columns, rows), axis=-1) + 0.5)
        hits, rows, columns = rays[rays.hit], rows[rays.hit], columns[rays.hit]
        seen[rows, columns] = True
        along = hits.distances * (hits.directions @ -camera.world_from_camera[:3, 2].numpy())
        depth[rows, columns] = np.clip(np.rint(1000.0 * along), 1, 65535).astype(np.uint16)

        rows, columns = np.nonzero(seen | near_edges)
        linear = self._supersample(camera, rows, columns, self._options.subsamples)
        partial = (linear[:, 3] > 0.0) & (linear[:, 3] < 1.0)
        linear[partial] = self._supersample(
            camera, rows[partial], columns[partial], self._options.edge_subsamples
        )
        rgba = np.zeros((height, width, 4), np.uint8)
        rgba[rows, columns] = _encode(linear)
        return _Shot(rgba=rgba, depth=depth)

    def _trace(self, camera: Cameras, pixels: np.ndarray) -> Hits:
        """Hits of rays through pixel positions (R, 2)."""
        return self._caster.pixel_hits(camera, torch.from_numpy(pixels.astype(np.float32)))

    def _supersample(self, camera: Cameras, rows: np.ndarray, columns: np.ndarray, count: int) -> np.ndarray:
        """Linear RGBA (K, 4) of pixels (K,): mean colour of what is hit, alpha the share that is hit."""
        pixels = np.stack((columns, rows), axis=-1)[:, None] + _lattice(count)
        rays = self._trace(camera, pixels.reshape(-1, 2))
        hits = rays[rays.hit]
        levels = self._texture_levels(_pixel_size(camera) / math.sqrt(count))
        colors = shade(self._surface, hits.triangles, hits.u, hits.v, levels)[:, :3]
        colors = self._options.light.lit(colors, self._normals[hits.triangles], hits.directions)
        number, owner = len(rows), np.flatnonzero(rays.hit) // count
        total = np.bincount(owner, minlength=number)
        sums = [np.bincount(owner, weights=channel, minlength=number) for channel in colors.T]
        rgb = np.stack(sums, axis=-1) / np.maximum(total, 1)[:, None]
        return np.concatenate((rgb, (total / count)[:, None]), axis=-1)

    def _texture_levels(self, footprint: float) -> np.ndarray:
        if footprint not in self._levels:
            self._levels[footprint] = texture_levels(self._surface, footprint)
        return self._levels[footprint]

    def _edge_pixels(self, camera: Cameras) -> np.ndarray:
        """Pixels (H, W) that an edge of a triangle may touch, and their neighbours."""
        spacing = 0.6 * _pixel_size(camera)  # nearer parts appear up to 1.7 times larger
        if spacing not in self._outline:
            points = _points_on_edges(self._surface.triangles, 0.5 * spacing)
            self._outline[spacing] = torch.from_numpy(points.astype(np.float32))
        pixels, _, in_front = project(camera, self._outline[spacing])
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
