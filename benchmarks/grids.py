"""Meshes: grid points evaluated, and whether leaving out the others changes the surface."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from charnerf.bench.subjects import Subject
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.optical_depth import SURFACE

CUBE_SIDE = 2.2  # m


@dataclass(frozen=True)
class GridShare:
    """A sparse grid against all points inside the hull.

    Attributes:
        share: Distinct grid points evaluated over (cells + 1)^3.
        all_share: Points that are evaluated when all inside the hull are.
        distance: Largest distance between their vertices' sets, m; 0 where faces are equal.
        seconds: Of the sparse grid with its surface; and of the full one.
    """

    share: float
    all_share: float
    distance: float
    seconds: float
    all_seconds: float


def grid_share(subject: Subject, *, cells: int, num_cameras: int) -> GridShare:
    """Extract a surface on a grid of cubic cells of CUBE_SIDE / cells m, sparse and full.

    Only the hull's box of the cube is laid out; the points outside it count as grid points that were not
    evaluated.

    Args:
        subject: The character.
        cells: Cells along a side of the cube.
        num_cameras: Cameras whose directions the density is averaged over.
    """
    start = time.perf_counter()
    sparse = grid_sampler(subject, cells, num_cameras)
    mesh = extract_surface(sparse.evaluate_surface(SURFACE), SURFACE).mesh
    middle = time.perf_counter()
    full = grid_sampler(subject, cells, num_cameras)
    other = extract_surface(full.evaluate_all(), SURFACE).mesh
    end = time.perf_counter()
    equal = mesh.faces.shape == other.faces.shape and bool(np.array_equal(mesh.faces, other.faces))
    distance = 0.0 if equal and np.allclose(mesh.vertices, other.vertices) else hausdorff(mesh, other)
    total = (cells + 1) ** 3
    return GridShare(
        share=sparse.num_evaluated / total,
        all_share=full.num_evaluated / total,
        distance=distance,
        seconds=middle - start,
        all_seconds=end - middle,
    )


def hausdorff(first: trimesh.Trimesh, second: trimesh.Trimesh) -> float:
    """Largest distance from a vertex of one mesh to the nearest of the other, m, both ways."""
    there = cKDTree(second.vertices).query(first.vertices)[0].max()
    back = cKDTree(first.vertices).query(second.vertices)[0].max()
    return float(max(there, back))


def grid_sampler(subject: Subject, cells: int, num_cameras: int) -> GridSampler:
    """A grid over the hull's box with cells of CUBE_SIDE / cells."""
    probe = GridSampler(subject.scene, resolution=16, num_cameras=num_cameras)
    longest = probe.spacing * 13  # a sampler lays resolution - 3 cells along the longest side
    resolution = round(longest / (CUBE_SIDE / cells)) + 3
    return GridSampler(subject.scene, resolution=max(16, resolution), num_cameras=num_cameras)
