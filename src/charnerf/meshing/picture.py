"""Pictures of a mesh by ray casting: its colours, unlit, antialiased."""

from __future__ import annotations

import numpy as np
import torch
import trimesh

from charnerf.data.color import srgb_from_linear
from charnerf.data.raycast import RayCaster
from charnerf.data.scene_mesh import COLORS_KEY, surface_of_scene
from charnerf.data.surface_mesh import shade
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.types import Cameras

OVERSAMPLING = 3  # rays a pixel, along each side


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
    caster = RayCaster(surface)
    width, height, many = cameras.width, cameras.height, OVERSAMPLING
    pixels = (pixel_centres(width * many, height * many) / many).reshape(-1, 2)
    pictures = []
    for index in range(len(cameras.orthographic)):
        rays = pixel_rays(cameras[index].to("cpu", torch.float32), pixels)
        hits = caster.first_hits(rays.origins.numpy(), rays.directions.numpy())
        hit = np.flatnonzero(hits.triangles >= 0)
        linear = np.zeros((len(pixels), 4), np.float32)
        linear[hit] = shade(surface, hits.triangles[hit], hits.u[hit], hits.v[hit])
        mean = linear.reshape(height, many, width, many, 4).mean(axis=(1, 3))
        rgb = srgb_from_linear(mean[..., :3] / np.maximum(mean[..., 3:], 1e-6))
        pictures.append(np.concatenate((rgb, mean[..., 3:]), axis=-1).astype(np.float32))
    return np.stack(pictures)
