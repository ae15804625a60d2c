"""Surfaces from density grids: marching cubes, floaters, decimation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import fast_simplification
import numpy as np
import trimesh
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from charnerf.errors import DataError, NumericalError
from charnerf.meshing.density_grid import DensityGrid
from charnerf.meshing.manifold import make_manifold

KEPT_SHARE = 0.01  # of the largest part's area: a part as large as this is kept wherever it is
KEPT_SPECK = 0.0005  # of the largest part's area: a smaller part is dropped wherever it is
KEPT_DISTANCE = 0.06  # metres: a part between the two is kept if it is this near to the largest
SECANT_STEPS = 3


@dataclass(frozen=True)
class Extraction:
    """A surface and what was removed from it.

    Attributes:
        mesh: Closed surface, world frame, metres, normals outward, without colours.
        level: Density of the surface, 1/m.
        num_floaters: Parts dropped because they are small and far from the figure, or specks.
        num_cavities: Closed holes inside, dropped because nobody sees them.
    """

    mesh: trimesh.Trimesh
    level: float
    num_floaters: int
    num_cavities: int


def extract_surface(
    grid: DensityGrid, level: float, *, density_at: Callable[[np.ndarray], np.ndarray] | None = None
) -> Extraction:
    """Surface of constant density by marching cubes.

    Vertices are placed on the edges of cells by linear interpolation of `density / (density + level)`, which
    runs almost straight through a surface where the density itself jumps by orders of magnitude, and then
    moved along their edges to where the density is the level.

    Args:
        grid: Densities with an empty outermost layer.
        level: Density of the surface, 1/m.
        density_at: Densities (P,), 1/m, at points (P, 3), m, for the second step; without it vertices stay
            interpolated.

    Raises:
        DataError: If the level is not positive.
        NumericalError: If no density exceeds the level; the message gives the range of the densities.
    """
    if not (level > 0 and np.isfinite(level)):
        raise DataError(f"level: found {level}, expected a positive density in 1/m.")
    low, high = float(grid.densities.min()), float(grid.densities.max())
    if not high > level:
        raise NumericalError(
            f"density grid: found densities from {low:.3g} to {high:.3g} 1/m, expected some above the level "
            f"{level:.3g} 1/m: there "
            "is no surface. The field is empty (train longer, or check the drawings' masks) or the level "
            "too high."
        )
    contrast = _contrast(grid.densities, level)
    vertices, faces, _, _ = marching_cubes(contrast, 0.0, allow_degenerate=False)
    if density_at is not None:
        vertices = _refine(vertices, grid, contrast, level, density_at)
    # faces of marching_cubes look towards higher values: turn them outward
    mesh = trimesh.Trimesh(grid.origin + vertices * grid.spacing, faces[:, ::-1], process=False)
    kept, floaters, cavities = drop_floaters(mesh)
    return Extraction(kept, level, floaters, cavities)


def _contrast(densities: np.ndarray, level: float) -> np.ndarray:
    """Densities mapped to [-1, 1], 0 at the level."""
    densities = np.asarray(densities, np.float64)
    return (densities - level) / (densities + level)


def _refine(
    vertices: np.ndarray,
    grid: DensityGrid,
    contrast: np.ndarray,
    level: float,
    density_at: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Move vertices (P, 3), in grid units, along their edges to the level (secant method, Illinois form).

    Edges with an end of no density at all stay as they are: they cross the border of the hull's cells, whose
    stairs are no detail.
    """
    below, above = np.floor(vertices), np.ceil(vertices)
    f_below, f_above = contrast[tuple(below.astype(int).T)], contrast[tuple(above.astype(int).T)]
    moving = np.flatnonzero((np.minimum(f_below, f_above) > -1.0) & (f_below * f_above < 0))
    start, edge = below[moving], (above - below)[moving]
    left, right = np.zeros(len(moving)), np.ones(len(moving))
    f_left, f_right = f_below[moving].copy(), f_above[moving].copy()
    share = ((vertices[moving] - start) * edge).sum(-1)
    for _ in range(SECANT_STEPS):
        value = _contrast(density_at(grid.origin + (start + share[:, None] * edge) * grid.spacing), level)
        on_left = value * f_left > 0
        left, right = np.where(on_left, share, left), np.where(on_left, right, share)
        f_right = np.where(on_left, 0.5 * f_right, value)
        f_left = np.where(on_left, value, 0.5 * f_left)
        share = left + (right - left) * (f_left / (f_left - f_right)).clip(0.01, 0.99)
    refined = vertices.copy()
    refined[moving] = start + share[:, None] * edge
    return refined


def drop_floaters(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, int, int]:
    """Keep the figure and what it holds.

    The largest part stays. Another part stays if its area is at least KEPT_SHARE of the largest's (a sword
    held loosely, a hat that hovers), or at least KEPT_SPECK and no more than KEPT_DISTANCE away from it.
    Closed cavities inside parts go.

    Returns:
        The mesh; how many floaters and cavities were dropped.
    """
    parts = mesh.split(only_watertight=False)
    if len(parts) <= 1:
        return mesh, 0, 0
    solid = [part for part in parts if part.volume > 0]
    solid.sort(key=lambda part: part.area, reverse=True)
    if not solid:
        raise NumericalError(
            "mesh: found only surfaces turned inside out, expected a closed figure. The field is broken."
        )
    kept, tree = [solid[0]], cKDTree(solid[0].vertices)
    for part in solid[1:]:
        if part.area >= solid[0].area * least_share(tree.query(part.vertices)[0].min()):
            kept.append(part)
    return _joined(kept), len(solid) - len(kept), len(parts) - len(solid)


def least_share(away: np.ndarray) -> np.ndarray:
    """Share of the largest part's area that parts (...) need to be kept, which lie so many metres away from it."""
    return np.where(away <= KEPT_DISTANCE, KEPT_SPECK, KEPT_SHARE)


def _joined(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """One mesh of several parts, without colours."""
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)])
    return trimesh.Trimesh(np.concatenate([part.vertices for part in parts]), faces, process=False)


def vertex_colors(mesh: trimesh.Trimesh) -> np.ndarray | None:
    """RGBA uint8 (P, 4) of a mesh whose vertices are coloured, else None."""
    visual = mesh.visual
    if isinstance(visual, trimesh.visual.ColorVisuals) and visual.kind == "vertex":
        return np.asarray(visual.vertex_colors)
    return None


def simplify(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """Reduce a mesh to about a number of faces by quadric decimation.

    Args:
        mesh: Any triangle mesh.
        faces: Faces wanted, at least 4; a mesh that has no more is returned as it is.

    Returns:
        A mesh without colours, or with the colours of the nearest original vertices where the mesh has
        vertex colours.
    """
    if faces < 4:
        raise DataError(f"faces: found {faces}, expected at least 4 (a closed surface has no fewer).")
    if len(mesh.faces) <= faces:
        return mesh
    points, triangles = fast_simplification.simplify(
        np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), target_count=faces, agg=5
    )[:2]
    result = trimesh.Trimesh(*make_manifold(points, triangles), process=False)
    colors = vertex_colors(mesh)
    if colors is not None:
        nearest = cKDTree(mesh.vertices).query(result.vertices)[1]
        result.visual = trimesh.visual.ColorVisuals(result, vertex_colors=colors[nearest])
    return result


def fit_height(mesh: trimesh.Trimesh, height: float) -> trimesh.Trimesh:
    """Scale a mesh about the vertical axis to exactly a height, m, its lowest point on z = 0."""
    if not (height > 0 and np.isfinite(height)):
        raise DataError(f"height: found {height} m, expected a positive height.")
    low, high = mesh.bounds[:, 2]
    if not high > low:
        raise DataError("mesh: found no extent in height, expected a standing figure.")
    normals = np.array(mesh.vertex_normals)  # those of vertices at texture seams belong to the whole surface
    scaled = mesh.copy()
    scaled.vertices = (np.asarray(mesh.vertices) - (0.0, 0.0, low)) * (height / (high - low))
    scaled.vertex_normals = normals  # type: ignore[method-assign]
    return scaled
