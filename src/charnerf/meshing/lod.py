"""Levels of detail: meshes of one character by grid and by number of faces, and the table of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from charnerf.errors import DataError
from charnerf.markdown import table
from charnerf.meshing.build import BuiltMesh, find_surface, finish_mesh
from charnerf.meshing.distance import surface_chamfer_mm
from charnerf.meshing.options import MeshOptions
from charnerf.scene import Scene
from charnerf.types import SourceViews

PAPER = {64: (1822, 3640), 128: (7646, 15288), 256: (49582, 98972)}
"""Vertices and polygons of the paper's Table I by grid."""


@dataclass(frozen=True)
class Lod:
    """One level of detail.

    Attributes:
        options: How it was made.
        built: The mesh.
        chamfer_mm: Distance of its surface from the finest level's, mm.
        seconds: Time it took, from what was there before: the field for grids, the finest grid's surface for
            decimated meshes.
    """

    options: MeshOptions
    built: BuiltMesh
    chamfer_mm: float
    seconds: float

    def row(self) -> dict[str, Any]:
        """The figures of the table."""
        surface = self.built.surface
        counts = self.built.left_out
        evaluated = 1.0 - counts.grid_cells / max(counts.grid_cells_of, 1)
        return {
            "grid": self.options.resolution,
            "faces_asked": self.options.faces,
            "vertices": len(surface.vertices),
            "faces": len(surface.faces),
            "parts": num_parts(surface),
            "watertight": bool(surface.is_watertight),
            "euler_number": int(surface.euler_number),
            "chamfer_mm": self.chamfer_mm,
            "evaluated": evaluated if self.options.faces is None else None,
            "seconds": self.seconds,
        }


def build_lods(
    scene: Scene,
    views: SourceViews | None,
    options: MeshOptions,
    *,
    resolutions: Sequence[int],
    faces: Sequence[int] = (),
    detailed: SourceViews | None = None,
    on_points: Callable[[int], object] = lambda count: None,
) -> tuple[Lod, ...]:
    """Make meshes of one field at several levels of detail.

    Args:
        scene: One character's field.
        views: Its drawings (B = 1).
        options: How each is made, grid and faces aside.
        resolutions: Grids, points along the longest side, whose surfaces keep all their faces; at least one.
        faces: Faces to decimate the finest grid's surface to.
        detailed: The drawings with more pixels, for textures; `views` themselves if None.
        on_points: Called with the number of grid points after each piece of work.

    Returns:
        The levels, most faces first; distances are to the first.

    Raises:
        ConfigError: If a grid or a number of faces is out of range.
        DataError: If there is no grid, or the hull is empty.
        NumericalError: If the field is empty or not finite.
    """
    if not resolutions:
        raise DataError("lod: found no grid, expected at least one, such as 128.")
    drawings = views if detailed is None else detailed
    grids = [replace(options, resolution=one, faces=None) for one in sorted(set(resolutions), reverse=True)]
    decimated = [replace(grids[0], faces=count) for count in sorted(set(faces), reverse=True)]
    made: list[tuple[MeshOptions, BuiltMesh, float]] = []
    finest = None
    for grid in grids:
        start = time.perf_counter()
        found = find_surface(scene, views, grid, on_points=on_points)
        finest = finest or found
        built = finish_mesh(scene, found, drawings, grid)
        made.append((grid, built, time.perf_counter() - start))
    assert finest is not None  # there is a grid
    for one in decimated:
        start = time.perf_counter()
        built = finish_mesh(scene, finest, drawings, one)
        made.append((one, built, time.perf_counter() - start))
    made.sort(key=lambda each: len(each[1].surface.faces), reverse=True)
    first = made[0][1].surface
    return tuple(Lod(one, built, _distance(built.surface, first), seconds) for one, built, seconds in made)


def _distance(mesh: trimesh.Trimesh, finest: trimesh.Trimesh) -> float:
    return 0.0 if mesh is finest else surface_chamfer_mm(mesh, finest)


def named(lods: Sequence[Lod], name: str) -> dict[str, Lod]:
    """Levels by file name without suffix, as engines pair them: NAME_LOD0 is the finest, each after it coarser and farther off.

    A level that another one of no more faces is nearer than is none of these: it is called by how it was made, such as
    NAME_LOD_grid64.
    """
    files, number = {}, 0
    for index, lod in enumerate(lods):
        if any(other.chamfer_mm < lod.chamfer_mm for other in lods[index + 1 :]):
            made = "" if lod.options.faces is None else f"_faces{lod.options.faces}"
            files[f"{name}_LOD_grid{lod.options.resolution}{made}"] = lod
        else:
            files[f"{name}_LOD{number}"] = lod
            number += 1
    return files


def lod_table(files: dict[str, Lod]) -> str:
    """The table of levels as Markdown, the paper's values beside those grids that it has."""
    heads = ["file", "grid", "vertices", "faces", "parts", "watertight", "Euler number", "Chamfer, mm"]
    heads += ["evaluated", "s", "paper: vertices, faces, Euler number"]
    rows = []
    for file, lod in files.items():
        row = lod.row()
        cells = [file, f"{row['grid']}", f"{row['vertices']}", f"{row['faces']}", f"{row['parts']}"]
        cells += ["yes" if row["watertight"] else "no", f"{row['euler_number']}", f"{row['chamfer_mm']:.2f}"]
        share = row["evaluated"]
        cells += ["-" if share is None else f"{100 * share:.1f} %", f"{row['seconds']:.1f}"]
        paper = PAPER.get(lod.options.resolution) if lod.options.faces is None else None
        cells.append("-" if paper is None else f"{paper[0]}, {paper[1]}, {paper[0] - paper[1] // 2}")
        rows.append(cells)
    return "\n".join(table(heads, rows))


def lod_report(files: dict[str, Lod]) -> str:
    """The text of lods.md."""
    return "\n".join(
        (
            "# Levels of detail",
            "",
            lod_table(files),
            "",
            "Chamfer: mean distance of the surface from the finest grid's and back. Evaluated: grid points of",
            "all that the field was asked for. Paper: Table I of CharNeRF, one character of its own; the Euler",
            "number is what its counts give for a closed surface (2 for one without holes or floaters). A level with a number is",
            "coarser and farther from the finest than the one before; one called by its grid has more faces than a nearer one.",
            "",
        )
    )


def num_parts(mesh: trimesh.Trimesh) -> int:
    """Connected parts of a mesh."""
    edges = np.asarray(mesh.edges)
    links = coo_array((np.ones(len(edges), bool), edges.T), shape=(len(mesh.vertices),) * 2)
    _, label = connected_components(links, directed=False)
    return len(np.unique(label[np.asarray(mesh.faces)[:, 0]]))
