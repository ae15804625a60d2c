"""Chamfer distance and F-score of a mesh against the captured one, by the surface that cameras see."""

from pathlib import Path

import numpy as np
import torch
import trimesh

from charnerf.data.surface import AreaSurface, visible_surface_points
from charnerf.data.visibility import see_points
from charnerf.errors import DataError
from charnerf.evaluation.metrics import chamfer_mm, f_score, parts_lost, surface_distances
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import interpolate
from charnerf.types import Cameras

NUM_POINTS = 50_000
"""Points a surface: their spacing alone puts equal surfaces of 2 square metres about 3 mm apart."""
SURFACE_KEYS = ("chamfer_mm", "f_score", "parts_lost")


def true_points(mesh_file: Path, *, seed: int = 0) -> np.ndarray:
    """Points (NUM_POINTS, 3) of the captured mesh's outer surface, m."""
    return visible_surface_points(mesh_file, NUM_POINTS, seed)[0]


def seen_points(
    mesh: trimesh.Trimesh, cameras: Cameras, *, num_points: int = NUM_POINTS, seed: int = 0
) -> np.ndarray:
    """Points evenly spread by area over the part of a mesh's surface that at least one camera sees.

    Args:
        mesh: World frame, m.
        cameras: (N,).
        num_points: How many are drawn before the hidden ones are dropped.
        seed: Of the draw.

    Returns:
        (M, 3), m, M <= num_points.

    Raises:
        DataError: If the mesh has no area, or no camera sees any of it.
    """
    bare = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    if not len(bare.faces) or not float(bare.area) > 0.0:
        raise DataError(
            f"mesh: found {len(bare.faces)} faces without area, expected a surface; lower its level."
        )
    surface = surface_of_scene(bare)
    draw = AreaSurface(surface).draw(num_points, torch.Generator().manual_seed(seed))
    points = interpolate(surface.triangles[draw.triangles], draw.u, draw.v).astype(np.float32)
    seen = points[see_points(surface, points, draw.triangles, cameras).visible]
    if not len(seen):
        raise DataError(
            "mesh: none of its surface is seen by a camera, expected it to stand where the cameras look; "
            "check its frame and its units."
        )
    return seen


def surface_scores(
    mesh: trimesh.Trimesh | None, truth: np.ndarray, cameras: Cameras
) -> tuple[dict[str, float | None], dict[str, str]]:
    """Chamfer distance (mm) and F-score of a mesh against true points (N, 3), or None with the reasons."""
    if mesh is None:
        return missing_surface("no surface was found")
    try:
        points = seen_points(mesh, cameras)
    except DataError as error:
        return missing_surface(str(error))
    distances = surface_distances(points, truth)
    return {
        "chamfer_mm": chamfer_mm(*distances),
        "f_score": f_score(*distances),
        "parts_lost": parts_lost(distances[1]),
    }, {}


def missing_surface(reason: str) -> tuple[dict[str, float | None], dict[str, str]]:
    """The scores of a surface that could not be had, with the reason."""
    return dict.fromkeys(SURFACE_KEYS, None), dict.fromkeys(SURFACE_KEYS, reason)
