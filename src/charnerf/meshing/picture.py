"""Pictures of a mesh by ray casting: its colours, unlit, or its shape alone; antialiased."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
import trimesh

from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.surfaces.color import srgb_from_linear
from charnerf.surfaces.raycast import Hits, RayCaster
from charnerf.surfaces.scene_mesh import COLORS_KEY, surface_of_scene
from charnerf.surfaces.surface_mesh import SurfaceMesh, interpolate, shade
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

    def colours(hits: Hits, hit: np.ndarray, directions: np.ndarray) -> np.ndarray:
        return shade(surface, hits.triangles[hit], hits.u[hit], hits.v[hit])[:, :3]

    return _photographs(surface, cameras, colours)


def render_clay(mesh: trimesh.Trimesh, cameras: Cameras) -> np.ndarray:
    """The shape alone, lit from the camera, smooth normals; arguments and result as of `render_mesh`."""
    corners = np.asarray(mesh.vertex_normals)[np.asarray(mesh.faces)]

    def colours(hits: Hits, hit: np.ndarray, directions: np.ndarray) -> np.ndarray:
        normals = interpolate(corners[hits.triangles[hit]], hits.u[hit], hits.v[hit])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        facing = np.maximum(-(normals * directions[hit]).sum(1), 0.0)
        return np.repeat(CLAY * (0.1 + 0.9 * facing[:, None]), 3, axis=1)

    bare = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return _photographs(surface_of_scene(bare), cameras, colours)


def _photographs(
    surface: SurfaceMesh,
    cameras: Cameras,
    colours: Callable[[Hits, np.ndarray, np.ndarray], np.ndarray],
) -> np.ndarray:
    """Pictures of a surface; the function gives linear RGB of hits by (hits, which, directions)."""
    caster = RayCaster(surface)
    width, height, many = cameras.width, cameras.height, OVERSAMPLING
    pixels = (pixel_centres(width * many, height * many) / many).reshape(-1, 2)
    pictures = []
    for index in range(len(cameras.orthographic)):
        rays = pixel_rays(cameras[index].to("cpu", torch.float32), pixels)
        directions = rays.directions.numpy()
        hits = caster.first_hits(rays.origins.numpy(), directions)
        hit = np.flatnonzero(hits.triangles >= 0)
        linear = np.zeros((len(pixels), 4), np.float32)
        linear[hit, :3], linear[hit, 3] = colours(hits, hit, directions), 1.0
        mean = linear.reshape(height, many, width, many, 4).mean(axis=(1, 3))
        rgb = srgb_from_linear(mean[..., :3] / np.maximum(mean[..., 3:], 1e-6))
        pictures.append(np.concatenate((rgb, mean[..., 3:]), axis=-1).astype(np.float32))
    return np.stack(pictures)
