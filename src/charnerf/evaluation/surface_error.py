"""Chamfer distance and F-score of a mesh against the captured one, by the surface that cameras see."""

from pathlib import Path

import numpy as np
import torch
import trimesh

from charnerf.errors import DataError
from charnerf.evaluation.metrics import F_SCORE_RADIUS_M, surface_distances
from charnerf.evaluation.ray_mesh import RayMesh
from charnerf.types import Cameras

NUM_POINTS = 50_000
"""Points a surface: their spacing alone puts equal surfaces of 2 square metres about 3 mm apart."""
_NUM_CAMERAS = 48
_RAY_OFFSET = 2e-3
_SURFACE_KEYS = ("chamfer_mm", "f_score")


def true_points(mesh_file: Path, *, seed: int = 0) -> np.ndarray:
    """Points (N, 3) of the captured mesh's outer surface, m."""
    from charnerf.data.surface import visible_surface_points

    return np.asarray(visible_surface_points(mesh_file, NUM_POINTS, seed)[0])


def seen_points(
    mesh: trimesh.Trimesh, cameras: Cameras, *, num_points: int = NUM_POINTS, seed: int = 0
) -> np.ndarray:
    """Points evenly spread by area over the part of a mesh's surface that at least one camera sees.

    Args:
        mesh: World frame, m.
        cameras: (N,); at most 48 of them, evenly chosen, are asked.
        num_points: How many are drawn before the hidden ones are dropped.
        seed: Of the draw.

    Returns:
        (M, 3), m, M <= num_points.

    Raises:
        DataError: If the mesh has no area, or no camera sees any of it.
    """
    if not len(mesh.faces) or not float(mesh.area) > 0.0:
        raise DataError(f"mesh: found {len(mesh.faces)} faces of area {mesh.area:g}, expected a surface.")
    points, faces = trimesh.sample.sample_surface(mesh, num_points, seed=np.random.default_rng(seed))
    points, normals = np.asarray(points, np.float32), np.asarray(mesh.face_normals[faces], np.float32)
    rays = RayMesh(mesh.vertices, mesh.faces)
    hidden = np.arange(num_points)
    count = int(cameras.shape[0])
    for index in torch.linspace(0, count - 1, min(count, _NUM_CAMERAS)).round().long().tolist():
        pose = cameras.world_from_camera[index].cpu().numpy()
        here = points[hidden]
        if bool(cameras.orthographic[index]):
            towards = np.broadcast_to(pose[:3, 2], here.shape)
        else:
            towards = pose[:3, 3] - here
            towards = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
        facing = np.sign((normals[hidden] * towards).sum(-1, keepdims=True))
        starts = here + _RAY_OFFSET * facing * normals[hidden]
        hidden = hidden[rays.occluded(starts, towards)]
    seen = np.delete(points, hidden, axis=0)
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
    there, back = surface_distances(points, truth)
    precision, recall = float((there <= F_SCORE_RADIUS_M).mean()), float((back <= F_SCORE_RADIUS_M).mean())
    total = precision + recall
    return {
        "chamfer_mm": float(500.0 * (there.mean() + back.mean())),
        "f_score": 2.0 * precision * recall / total if total else 0.0,
    }, {}


def missing_surface(reason: str) -> tuple[dict[str, float | None], dict[str, str]]:
    """The scores of a surface that could not be had, with the reason."""
    return dict.fromkeys(_SURFACE_KEYS, None), dict.fromkeys(_SURFACE_KEYS, reason)
