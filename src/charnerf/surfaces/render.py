"""Pictures of a mesh by ray casting: its colours, unlit, or its shape alone; antialiased."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh

from charnerf.geometry.cameras import pixel_centres
from charnerf.surfaces.color import srgb_from_linear
from charnerf.surfaces.raycast import Hits, RayCaster
from charnerf.surfaces.scene_mesh import COLORS_KEY, surface_of_scene
from charnerf.surfaces.surface_mesh import interpolate, shade
from charnerf.types import Cameras

OVERSAMPLING = 3  # rays a pixel, along each side
CLAY = 0.75  # linear light of clay seen straight on


def render_mesh(mesh: trimesh.Trimesh, cameras: Cameras) -> np.ndarray:
    """Look at a mesh from cameras.

    Args:
        mesh: World frame; vertex colours sRGB-encoded, or a base-colour texture.
        cameras: (N,).

    Returns:
        (N, H, W, 4), float32 RGBA in [0, 1], sRGB-encoded, straight alpha; averaged in linear light.
    """
    named = mesh.copy()
    named.metadata[COLORS_KEY] = "srgb"
    surface = surface_of_scene(named)

    def colors(hits: Hits) -> np.ndarray:
        return shade(surface, hits.triangles, hits.u, hits.v)[:, :3]

    return _pictures(RayCaster.of_surface(surface), cameras, colors)


def render_clay(mesh: trimesh.Trimesh, cameras: Cameras) -> np.ndarray:
    """The shape alone, lit from the camera, smooth normals; arguments and result as of `render_mesh`."""
    corners = np.asarray(mesh.vertex_normals)[np.asarray(mesh.faces)]

    def colors(hits: Hits) -> np.ndarray:
        normals = interpolate(corners[hits.triangles], hits.u, hits.v)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        facing = np.maximum(-(normals * hits.directions).sum(1), 0.0)
        return np.repeat(CLAY * (0.1 + 0.9 * facing[:, None]), 3, axis=1)

    return _pictures(RayCaster(mesh.triangles), cameras, colors)


def _pictures(caster: RayCaster, cameras: Cameras, colors: Callable[[Hits], np.ndarray]) -> np.ndarray:
    """Pictures of what rays hit, in the linear RGB (K, 3) that a function gives of hits (K,)."""
    width, height, many = cameras.width, cameras.height, OVERSAMPLING
    pixels = (pixel_centres(width * many, height * many) / many).reshape(-1, 2)
    pictures = []
    for index in range(len(cameras.orthographic)):
        hits = caster.pixel_hits(cameras[index], pixels)
        linear = np.zeros((len(pixels), 4), np.float32)
        linear[hits.hit, :3], linear[hits.hit, 3] = colors(hits[hits.hit]), 1.0
        mean = linear.reshape(height, many, width, many, 4).mean(axis=(1, 3))
        rgb = srgb_from_linear(mean[..., :3] / np.maximum(mean[..., 3:], 1e-6))
        pictures.append(np.concatenate((rgb, mean[..., 3:]), axis=-1).astype(np.float32))
    return np.stack(pictures)
