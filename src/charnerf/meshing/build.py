"""From one character's field to a finished mesh."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import trimesh

from charnerf.meshing.calibrate import LevelChoice, choose_level
from charnerf.meshing.colour import colour_vertices
from charnerf.meshing.density_grid import GridSampler
from charnerf.meshing.extract import extract_surface, fit_height, simplify
from charnerf.types import LeftOut, Scene, SourceViews


@dataclass(frozen=True)
class BuiltMesh:
    """A coloured mesh and how it came about.

    Attributes:
        mesh: World frame, metres, vertex colours sRGB.
        level: Density of the surface, 1/m.
        choice: The evidence for the level; None where the caller gave it.
        num_extracted: Faces before decimation.
        num_floaters: Parts dropped.
        num_cavities: Hidden holes dropped.
        left_out: Grid points not evaluated.
        seconds: Time it took.
    """

    mesh: trimesh.Trimesh
    level: float
    choice: LevelChoice | None
    num_extracted: int
    num_floaters: int
    num_cavities: int
    left_out: LeftOut
    seconds: float


def build_mesh(
    scene: Scene,
    views: SourceViews | None,
    *,
    resolution: int = 128,
    num_cameras: int = 8,
    faces: int | None = None,
    level: float | None = None,
    height: float | None = None,
    on_points: Callable[[int], object] = lambda count: None,
) -> BuiltMesh:
    """Make a mesh of a character's field.

    Args:
        scene: One character's field.
        views: Its drawings (B = 1), whose silhouettes are compared with the surface's.
        resolution: Grid points along the longest side of the hull.
        num_cameras: Cameras whose directions the density is averaged over.
        faces: Faces after decimation; None keeps all.
        level: Density of the surface, 1/m; None chooses it by rendered depths.
        height: Height to scale to, m, with the lowest point on z = 0; None leaves size and place as the
            field has them.
        on_points: Called with the number of grid points after each piece of work.

    Raises:
        DataError: If an argument is out of range or the hull empty.
        NumericalError: If the field is empty or not finite.
    """
    start = time.perf_counter()
    sampler = GridSampler(scene, resolution=resolution, num_cameras=num_cameras, on_points=on_points)
    choice = None
    if level is None:
        choice = choose_level(sampler.evaluate_coarse(2 if resolution < 192 else 4), views)
        level = choice.chosen.level
    grid = sampler.evaluate_surface(level)
    surface = extract_surface(grid, level, density_at=sampler.density_at)
    mesh = surface.mesh if faces is None else simplify(surface.mesh, faces)
    mesh = colour_vertices(scene, mesh)
    if height is not None:
        mesh = fit_height(mesh, height)
    return BuiltMesh(
        mesh=mesh,
        level=level,
        choice=choice,
        num_extracted=len(surface.mesh.faces),
        num_floaters=surface.num_floaters,
        num_cavities=surface.num_cavities,
        left_out=grid.left_out,
        seconds=time.perf_counter() - start,
    )
