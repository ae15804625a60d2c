"""Surfaces from grids: marching cubes, floaters, decimation."""

from __future__ import annotations

from dataclasses import dataclass

import fast_simplification
import numpy as np
import trimesh
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from charnerf.errors import DataError, NumericalError
from charnerf.meshing.grid import Grid
from charnerf.meshing.manifold import make_manifold

KEPT_SHARE = 0.01  # of the largest part's area: a part as large as this is kept wherever it is
KEPT_SPECK = 0.0005  # of the largest part's area: a smaller part is dropped wherever it is
KEPT_DISTANCE = 0.06  # metres: a part between the two is kept if it is this near to the largest


@dataclass(frozen=True)
class Extraction:
    """A surface and what was removed from it.

    Attributes:
        mesh: Closed surface, world frame, metres, normals outward, without colours.
        num_floaters: Parts dropped because they are small and far from the figure, or specks.
        num_cavities: Closed holes inside, dropped because nobody sees them.
    """

    mesh: trimesh.Trimesh
    num_floaters: int
    num_cavities: int


def extract_surface(grid: Grid, level: float) -> Extraction:
    """Surface of a constant value by marching cubes.

    Vertices lie on the edges of cells by linear interpolation of `Grid.contrast`, which runs almost straight through a
    surface where values grow by orders of magnitude.

    Args:
        grid: Optical depths, or densities, 1/m, with an empty outermost layer.
        level: Value of the surface.

    Raises:
        DataError: If the level is not positive.
        NumericalError: If no value exceeds the level; the message gives the range of the values.
    """
    if not (level > 0 and np.isfinite(level)):
        raise DataError(f"level: found {level}, expected a positive value.")
    low, high = float(grid.values.min()), float(grid.values.max())
    if not high > level:
        raise NumericalError(
            f"grid: found values from {low:.3g} to {high:.3g}, expected some above the surface's {level:.3g}: there is no surface. "
            "The field is empty: train longer, or check the drawings' masks."
        )
    vertices, faces, _, _ = marching_cubes(grid.contrast(level), 0.0, allow_degenerate=False)
    # faces of marching_cubes look towards higher values: turn them outward
    mesh = trimesh.Trimesh(grid.origin + vertices * grid.spacing, faces[:, ::-1], process=False)
    kept, floaters, cavities = drop_floaters(mesh)
    return Extraction(kept, floaters, cavities)


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
