"""How many cameras the averaged density needs, and how much densities depend on the direction at all."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
import trimesh
from torch import Tensor

from charnerf.geometry.safe import safe_normalize
from charnerf.markdown import table
from charnerf.meshing.density import camera_positions
from charnerf.meshing.distance import surface_chamfer_mm
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.grid_sampler import GridSampler
from charnerf.meshing.optical_depth import SURFACE
from charnerf.scene import AbstractField, DensityOutput, Scene
from charnerf.types import FieldOutput, TensorRecord

COUNTS = (1, 2, 4, 8, 16)
PROBES = 2_000  # points near the surface where directions are compared
DIRECTIONS = 16
STRONG = 0.25  # standard deviation over directions by the mean, from which on a mesh depends on the choice
SETTLED_MM = 1.0  # a mesh this near to that of the most cameras counts as the same


@dataclass(frozen=True)
class ConvergenceRow:
    """A mesh by some cameras.

    Attributes:
        num_cameras: N; 0 stands for the zero direction.
        distance_mm: Chamfer distance to the mesh of the most cameras, mm.
        volume: Of the mesh, m^3.
        num_faces: Of the mesh.
        seconds: For grid and surface.
    """

    num_cameras: int
    distance_mm: float
    volume: float
    num_faces: int
    seconds: float


@dataclass(frozen=True)
class Convergence:
    """Mesh distance against the number of cameras.

    Attributes:
        rows: By number; empty where the density sees no direction, since one evaluation then is exact.
        spread: Standard deviation of the density over directions by its mean, mean over points near the
            surface.
        exact: Whether the density sees no direction.
    """

    rows: tuple[ConvergenceRow, ...]
    spread: float
    exact: bool

    @property
    def enough(self) -> int:
        """Fewest cameras whose mesh, and every one of more, is that of the most, within SETTLED_MM."""
        settled = 1
        for row in self.rows:
            if row.num_cameras > 0 and row.distance_mm > SETTLED_MM:
                settled = next(
                    (one.num_cameras for one in self.rows if one.num_cameras > row.num_cameras),
                    row.num_cameras,
                )
        return settled

    @property
    def warning(self) -> str | None:
        """What is to be said where densities depend strongly on the direction."""
        if self.spread <= STRONG:
            return None
        return (
            f"the density depends strongly on the direction: near the surface it varies by {100 * self.spread:.0f} % "
            f"(standard deviation over {DIRECTIONS} cameras), so that the mesh depends on how many cameras are "
            f"averaged; {self.enough} are enough here. density=view_free has no such dependence."
        )


def measure_convergence(
    scene: Scene,
    *,
    resolution: int = 64,
    counts: Sequence[int] = COUNTS,
) -> Convergence:
    """Make a character's surface by several numbers of cameras and compare.

    Args:
        scene: One character's field.
        resolution: Grid points along the longest side.
        counts: Numbers of cameras, ascending; the last one is what the others are compared with.
    """
    most = 1 if not scene.field.sees_directions else max(counts)
    reference, _ = _surface(scene, resolution, most)
    spread = direction_spread(scene, np.asarray(reference.vertices))
    if not scene.field.sees_directions:
        return Convergence((), spread, True)
    rows = []
    for count in (0, *sorted(counts)):
        seen = scene if count else Scene(_Undirected(scene.field), None, scene.bounds)
        mesh, seconds = _surface(seen, resolution, max(count, 1))
        distance = surface_chamfer_mm(mesh, reference)
        rows.append(ConvergenceRow(count, distance, float(mesh.volume), len(mesh.faces), seconds))
    return Convergence(tuple(rows), spread, False)


@final
@dataclass(frozen=True)
class _Undirected(AbstractField):
    """A field whose averaging asks with the zero direction, once."""

    inner: AbstractField
    sees_directions: bool = False

    def __call__(self, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        return self.inner(points, view_dirs)

    def densities(self, points: Tensor, view_dirs: Tensor) -> DensityOutput:
        return self.inner.densities(points, view_dirs)

    def colors(self, state: TensorRecord) -> Tensor:
        return self.inner.colors(state)


def _surface(scene: Scene, resolution: int, cameras: int) -> tuple[trimesh.Trimesh, float]:
    start = time.perf_counter()
    sampler = GridSampler(scene, resolution=resolution, num_cameras=cameras)
    mesh = extract_surface(sampler.evaluate_surface(SURFACE), SURFACE).mesh
    return mesh, time.perf_counter() - start


@torch.no_grad()
def direction_spread(scene: Scene, near: np.ndarray) -> float:
    """Standard deviation of the density over directions by its mean, averaged over points (P, 3), m."""
    chosen = near[:: max(1, len(near) // PROBES)].astype(np.float32)
    points = torch.from_numpy(chosen).to(scene.bounds.box_min.device)
    answers = torch.stack(
        [
            scene.field.densities(points, safe_normalize(points - position)).densities.double()
            for position in camera_positions(scene, DIRECTIONS).to(points)
        ]
    )
    mean = answers.mean(0)
    return float((answers.std(0, correction=0) / mean.clamp_min(1e-6)).mean())


def convergence_lines(result: Convergence) -> list[str]:
    """Markdown of a report."""
    lines = ["## Cameras averaged over", ""]
    if result.exact:
        return [
            *lines,
            f"The density of these weights sees no direction (measured: it varies by {100 * result.spread:.2g} % over "
            f"{DIRECTIONS} cameras near the surface): one evaluation is exact, whatever number of cameras is asked for.",
            "",
        ]
    lines += ["Chamfer distance to the surface of the most cameras.", ""]
    rows = []
    for row in result.rows:
        name = f"{row.num_cameras}" if row.num_cameras else "none (zero direction)"
        cells = [name, f"{row.distance_mm:.2f}", f"{1000 * row.volume:.1f}"]
        rows.append([*cells, f"{row.num_faces}", f"{row.seconds:.1f}"])
    lines += table(("cameras", "distance, mm", "volume, l", "faces", "seconds"), rows)
    lines += [
        "",
        f"{result.enough} cameras are enough (within {SETTLED_MM:g} mm). Near the surface the density varies "
        f"by {100 * result.spread:.0f} % over directions.",
        "",
    ]
    if result.warning is not None:
        lines += [f"- **warning**: {result.warning}", ""]
    return lines
