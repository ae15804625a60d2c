"""From one character's field to a finished mesh."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import trimesh

from charnerf.meshing.extract import Extraction, extract_surface, fit_height, simplify
from charnerf.meshing.field_colors import color_vertices
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.loose import tidied
from charnerf.meshing.optical_depth import SURFACE
from charnerf.meshing.options import MeshOptions
from charnerf.meshing.outlines import covering
from charnerf.meshing.smooth import smooth_mesh
from charnerf.meshing.texture import Textured, texture_mesh
from charnerf.scene import Scene
from charnerf.types import LeftOut, SourceViews


@dataclass(frozen=True)
class FoundSurface:
    """A surface as it was found in a field, without colours.

    Attributes:
        extraction: The surface and what was removed from it.
        missed: Share of the drawings' pixels of the figure that met no surface, until optical depths were raised there.
        num_joined: Loose parts that were joined to the figure.
        num_unneeded: Loose parts that were left out because no drawing needs them.
        left_out: Grid points not evaluated.
        seconds: Time it took.
    """

    extraction: Extraction
    missed: float
    num_joined: int
    num_unneeded: int
    left_out: LeftOut
    seconds: float


@dataclass(frozen=True)
class BuiltMesh:
    """A coloured mesh and how it came about.

    Attributes:
        mesh: World frame, metres; vertex colours (sRGB) or a base-colour texture.
        surface: The same before its vertices were split at texture seams; `mesh` itself without a texture.
        found: The surface that it was made of, with all of its faces.
        textured: How the texture came about; None where there is none.
        seconds: Time it took.
    """

    mesh: trimesh.Trimesh
    surface: trimesh.Trimesh
    found: FoundSurface
    textured: Textured | None
    seconds: float

    @property
    def missed(self) -> float:
        """Share of the drawings' pixels of the figure whose optical depths were raised (see outlines.py)."""
        return self.found.missed

    @property
    def num_floaters(self) -> int:
        """Loose parts left out, of which no drawing needs `found.num_unneeded`."""
        return self.found.num_unneeded + self.found.extraction.num_floaters

    @property
    def num_cavities(self) -> int:
        """Hidden holes dropped."""
        return self.found.extraction.num_cavities

    @property
    def num_extracted(self) -> int:
        """Faces before decimation."""
        return len(self.found.extraction.mesh.faces)

    @property
    def left_out(self) -> LeftOut:
        """Grid points not evaluated."""
        return self.found.left_out


def build_mesh(
    scene: Scene,
    views: SourceViews | None,
    options: MeshOptions,
    *,
    detailed: SourceViews | None = None,
    on_points: Callable[[int], object] = lambda count: None,
) -> BuiltMesh:
    """Make a mesh of a character's field.

    Args:
        scene: One character's field.
        views: Its drawings (B = 1): optical depths are raised where the surface would miss their silhouettes; None has none.
        options: How it is made.
        detailed: The drawings with more pixels, for a texture; `views` themselves if None.
        on_points: Called with the number of grid points after each piece of work.

    Raises:
        DataError: If the hull is empty, or there are too many faces for a texture.
        NumericalError: If the field is empty or not finite.
    """
    found = find_surface(scene, views, options, on_points=on_points)
    return finish_mesh(scene, found, views if detailed is None else detailed, options)


def find_surface(
    scene: Scene,
    views: SourceViews | None,
    options: MeshOptions,
    *,
    on_points: Callable[[int], object] = lambda count: None,
) -> FoundSurface:
    """The surface of a field, all of its faces; arguments and errors as of `build_mesh`."""
    start = time.perf_counter()
    sampler = GridSampler(
        scene, resolution=options.resolution, num_cameras=options.num_cameras, on_points=on_points
    )
    grid, missed, num_joined, num_unneeded = sampler.evaluate_surface(SURFACE), 0.0, 0, 0
    if views is not None:
        grid, missed = covering(grid, views, SURFACE)
        grid, num_joined, num_unneeded = tidied(grid, SURFACE, views)
    extraction = extract_surface(grid, SURFACE)
    extraction = replace(extraction, mesh=smooth_mesh(extraction.mesh, options.smooth))
    seconds = time.perf_counter() - start
    return FoundSurface(extraction, missed, num_joined, num_unneeded, grid.left_out, seconds)


def finish_mesh(
    scene: Scene, found: FoundSurface, drawings: SourceViews | None, options: MeshOptions
) -> BuiltMesh:
    """Decimate, color and scale a surface that was found; errors as of `build_mesh`."""
    start = time.perf_counter()
    extraction, textured = found.extraction, None
    surface = extraction.mesh if options.faces is None else simplify(extraction.mesh, options.faces)
    if options.texture == "vertex":
        surface = mesh = color_vertices(scene, surface)
    else:
        used = drawings if options.texture == "drawings" else None
        textured = texture_mesh(scene, surface, used, size=options.texture_size)
        mesh = textured.mesh
    if options.height is not None:
        mesh, surface = fit_height(mesh, options.height), fit_height(surface, options.height)
    return BuiltMesh(mesh, surface, found, textured, found.seconds + time.perf_counter() - start)
