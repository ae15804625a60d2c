"""Densities on a grid of the hull's box, evaluated only where they can matter.

Letters: N cameras averaged over; X, Y, Z grid points along the axes. A cell is the cube between eight grid
    points; a block is a cube
of `BLOCK` cells a side and shares its outer points with its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor
from torch.nn import functional as F

from charnerf.errors import DataError, NumericalError
from charnerf.geometry.cameras import fibonacci_hemisphere
from charnerf.geometry.framing import LEAST_DISTANCE
from charnerf.geometry.safe import safe_normalize
from charnerf.scene import Scene
from charnerf.types import LeftOut

BLOCK = 4  # cells a side
CHUNK = 8192  # points evaluated at once; larger batches leave the caches
MIDDLE_LEVEL = 20.0  # 1/m; where interpolation between grid points is most faithful
ACTIVE_SHARE = 0.25  # a block counts as near the surface from this share of the level on


@dataclass(frozen=True)
class DensityGrid:
    """Densities at the points of a regular grid whose outermost layer is empty.

    Attributes:
        densities: (X, Y, Z), float32, 1/m, zero outside the hull. Blocks that carry no surface hold values
            interpolated from their corners.
        origin: World position of point (0, 0, 0), (3,), m.
        spacing: Edge of a cell, m.
        left_out: Grid points that were not evaluated, of all.
    """

    densities: np.ndarray
    origin: np.ndarray
    spacing: float
    left_out: LeftOut

    def between(self, device: torch.device | str = "cpu") -> Callable[[Tensor], Tensor]:
        """The function that reads densities (...) at points (..., 3), m, between the grid's; the border's beyond it.

        Interpolated in a scale that runs nearly straight through a surface, as density itself does not.
        """
        volume = torch.from_numpy(np.ascontiguousarray(self.densities)).to(device)
        contrast = (volume / (volume + MIDDLE_LEVEL))[None, None]
        corner = torch.from_numpy(self.origin).to(volume)
        extent = (torch.tensor(volume.shape) - 1).to(volume) * self.spacing

        def read(points: Tensor) -> Tensor:
            at = 2.0 * (points.to(volume) - corner) / extent - 1.0
            # grid_sample takes the last axis of the volume first
            flat = at.flip(-1).reshape(1, 1, 1, -1, 3)
            found = F.grid_sample(contrast, flat, align_corners=True, padding_mode="border").view(
                points.shape[:-1]
            )
            return MIDDLE_LEVEL * found / (1.0 - found).clamp_min(1e-6)

        return read


def densities_inside(scene: Scene, points: Tensor, *view_dirs: Tensor) -> Tensor:
    """Densities (P,), 1/m, of points (P, 3): the mean over view_dirs, (P, 3) each; zero outside the hull, unevaluated."""
    inside = scene.bounds.may_hold(points).nonzero()[:, 0]
    densities = points.new_zeros(len(points))
    for part in inside.split(CHUNK):
        answers = [scene.field.densities(points[part], dirs[part]).densities for dirs in view_dirs]
        densities[part] = torch.stack(answers).mean(0)
    return densities


def averaged_density(scene: Scene, points: Tensor, num_cameras: int) -> Tensor:
    """Density averaged over cameras around the character.

    Args:
        scene: One character's field.
        points: (P, 3), m.
        num_cameras: N, cameras on the upper hemisphere whose directions are averaged over. Where the density
            sees no direction one evaluation (with the zero direction) says all.

    Returns:
        Densities (P,), 1/m; zero outside the hull, where nothing is evaluated.

    Raises:
        NumericalError: If the field answers NaN or infinity.

    Source: paper, Mesh Reconstruction (several cameras, averaged, instead of the zero direction).
    """
    view_dirs = [torch.zeros_like(points)]
    if scene.field.sees_directions:
        positions = camera_positions(scene, num_cameras).to(points)
        view_dirs = [safe_normalize(points - position) for position in positions]
    densities = densities_inside(scene, points, *view_dirs)
    if not bool(densities.isfinite().all()):
        bad = int((~densities.isfinite()).sum())
        raise NumericalError(
            f"density field: found {bad} of {densities.numel()} values not finite, expected finite "
            "densities. "
            "The weights are broken: load another checkpoint."
        )
    return densities


def camera_positions(scene: Scene, num_cameras: int) -> Tensor:
    """Where the averaged cameras stand, (N, 3), m."""
    if num_cameras < 1:
        raise DataError(f"num_cameras: found {num_cameras}, expected at least 1.")
    centre = 0.5 * (scene.bounds.box_min + scene.bounds.box_max)
    return centre + LEAST_DISTANCE * fibonacci_hemisphere(num_cameras).to(centre)


class GridSampler:
    """Fills a density grid piece by piece and remembers what was evaluated.

    The grid covers the occupied part of the hull (the whole box without a hull) with cubic cells,
    `resolution` points along its longest side, and a layer of empty points around, so that every surface in
    it is closed.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        resolution: int,
        num_cameras: int,
        on_points: Callable[[int], object] = lambda count: None,
    ) -> None:
        """Lay out the grid.

        Args:
            scene: One character's field.
            resolution: Points along the longest side, at least 16.
            num_cameras: N.
            on_points: Called with the number of points after each piece of work, for a progress bar.

        Raises:
            DataError: If the resolution is too small or the hull empty.
        """
        if resolution < 16:
            raise DataError(f"resolution: found {resolution} grid points, expected at least 16.")
        self._scene, self._num_cameras, self._on_points = scene, num_cameras, on_points
        self._gains: list[Callable[[Tensor], Tensor]] = []
        low, high = _occupied_box(scene)
        self.spacing = float((high - low).max()) / (resolution - 3)
        self.origin = low - self.spacing
        cells = np.ceil((high - low) / self.spacing - 1e-9).astype(int) + 2
        cells = -(-cells // BLOCK) * BLOCK  # whole blocks
        self.shape: tuple[int, int, int] = tuple(int(c) + 1 for c in cells)  # type: ignore[assignment]
        self.values = np.zeros(self.shape, np.float32)
        self.known = np.zeros(self.shape, bool)  # evaluated, or empty by definition
        self.inside = self._inside()
        self.known[~self.inside] = True
        self.num_evaluated = 0

    def _points(self, index: np.ndarray) -> Tensor:
        """World positions (P, 3) of grid points by index (P, 3)."""
        return torch.from_numpy((self.origin + index * self.spacing).astype(np.float32)).to(
            self._scene.bounds.box_min.device
        )

    def _inside(self) -> np.ndarray:
        """Which points may have a density and lie off the outermost layer, (X, Y, Z) bool."""
        inside = np.zeros(self.shape, bool)
        inside[1:-1, 1:-1, 1:-1] = True
        for x in range(1, self.shape[0] - 1):
            layer = np.argwhere(inside[x])
            index = np.concatenate((np.full((len(layer), 1), x), layer), axis=1)
            inside[x][inside[x]] = self._scene.bounds.may_hold(self._points(index)).cpu().numpy()
        return inside

    @torch.no_grad()
    def evaluate(self, wanted: np.ndarray) -> None:
        """Evaluate the points of a mask (X, Y, Z) that are not known yet."""
        index = np.argwhere(wanted & ~self.known)
        for start in range(0, len(index), CHUNK):
            part = index[start : start + CHUNK]
            self.values[tuple(part.T)] = self._densities(self._points(part)).cpu().numpy()
            self._on_points(len(part))
        self.known[tuple(index.T)] = True
        self.num_evaluated += len(index)

    def evaluate_all(self) -> DensityGrid:
        """Evaluate every point inside the hull."""
        self.evaluate(np.ones(self.shape, bool))
        return self._result()

    def evaluate_coarse(self, stride: int) -> DensityGrid:
        """Evaluate every stride-th point alone and return the grid of these (stride divides BLOCK)."""
        every = (slice(None, None, stride),) * 3
        wanted = np.zeros(self.shape, bool)
        wanted[every] = True
        self.evaluate(wanted)
        values = self.values[every].copy()
        _empty_border(values)
        return DensityGrid(values, self.origin, self.spacing * stride, self._left_out())

    def evaluate_surface(self, level: float) -> DensityGrid:
        """Evaluate the blocks that the surface at a level passes through, and no other.

        Blocks are found from every second point of the grid where these come near the level, and then along
        the surface: where it leaves an evaluated block, its neighbour is evaluated too, until it leaves
        none. Every connected part of the surface that touches one of the first blocks is therefore the same
        as on the full grid.

        Args:
            level: Density of the surface, 1/m.
        """
        self.evaluate_coarse(2)
        lattice = self.values[::2, ::2, ::2]
        half = BLOCK // 2
        low, high = _block_extremes(lattice, half)
        active = (high >= ACTIVE_SHARE * level) & (low < level)
        done = np.zeros_like(active)
        while bool((active & ~done).any()):
            self.evaluate(_points_of_blocks(active & ~done, self.shape))
            done |= active
            active |= self._entered_from(done, level)
        self._fill_unknown(lattice)
        return self._result()

    def _entered_from(self, done: np.ndarray, level: float) -> np.ndarray:
        """Blocks into which the surface leads from evaluated ones: a shared face has points on both sides."""
        above = self.values > level
        entered = np.zeros_like(done)
        for axis in range(3):
            # extremes over the face between block i and i + 1 along the axis
            faces: np.ndarray = np.take(above, np.arange(0, self.shape[axis], BLOCK), axis=axis)
            some: np.ndarray = faces
            every: np.ndarray = faces
            for other in range(3):
                if other != axis:
                    some = np.any(_windows(some, BLOCK, other), axis=-1)
                    every = np.all(_windows(every, BLOCK, other), axis=-1)
            crossed = np.moveaxis(some & ~every, axis, 0)[1:-1]
            blocks, result = np.moveaxis(done, axis, 0), np.moveaxis(entered, axis, 0)
            result[1:] |= crossed & blocks[:-1]
            result[:-1] |= crossed & blocks[1:]
        return entered & ~done

    def _fill_unknown(self, lattice: np.ndarray) -> None:
        """Give points of blocks without surface the values between their known neighbours."""
        unknown = ~self.known
        if unknown.any():
            at = np.argwhere(unknown).T / 2.0
            self.values[unknown] = ndimage.map_coordinates(lattice, at, order=1, mode="nearest")

    @torch.no_grad()
    def multiply(self, gain: Callable[[Tensor], Tensor]) -> None:
        """Multiply all densities, those evaluated so far and those to come, by `gain` of points (P, 3)."""
        index = np.argwhere(self.values > 0.0)
        for start in range(0, len(index), CHUNK):
            part = index[start : start + CHUNK]
            self.values[tuple(part.T)] *= gain(self._points(part)).cpu().numpy()
        self._gains.append(gain)

    def _densities(self, points: Tensor) -> Tensor:
        """Averaged densities (P,) of points (P, 3), multiplied."""
        densities = averaged_density(self._scene, points, self._num_cameras)
        for gain in self._gains:
            densities = densities * gain(points)
        return densities

    @torch.no_grad()
    def density_at(self, points: np.ndarray) -> np.ndarray:
        """Averaged density (P,), 1/m, at any points (P, 3), m."""
        tensor = torch.from_numpy(points.astype(np.float32)).to(self._scene.bounds.box_min.device)
        self._on_points(len(points))
        return self._densities(tensor).double().cpu().numpy()

    def _left_out(self) -> LeftOut:
        total = int(np.prod(self.shape))
        return LeftOut(grid_cells=total - self.num_evaluated, grid_cells_of=total)

    def _result(self) -> DensityGrid:
        return DensityGrid(self.values, self.origin, self.spacing, self._left_out())


def _occupied_box(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the part of the box that can carry density, (3,) float64 each, m."""
    bounds = scene.bounds
    hull = bounds.hull
    if hull is None:
        return bounds.box_min.double().cpu().numpy(), bounds.box_max.double().cpu().numpy()
    index = hull.occupancy.nonzero()
    if len(index) == 0:
        raise DataError(
            "visual hull: found no occupied cell, expected a figure. Check the masks of the drawings."
        )
    corner = hull.box_min.double()
    cell = (hull.box_max.double() - corner) / hull.occupancy.shape[0]
    low, high = corner + index.amin(0) * cell, corner + (index.amax(0) + 1) * cell
    return low.cpu().numpy(), high.cpu().numpy()


def _empty_border(values: np.ndarray) -> None:
    for axis in range(3):
        view = np.moveaxis(values, axis, 0)
        view[0] = 0.0
        view[-1] = 0.0


def _windows(values: np.ndarray, size: int, axis: int) -> np.ndarray:
    """Windows of size + 1 points, size apart, along an axis; the window becomes the last axis."""
    every = np.lib.stride_tricks.sliding_window_view(values, size + 1, axis=axis)
    return every[(slice(None),) * axis + (slice(None, None, size),)]


def _block_extremes(values: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest value of each block of size cells a side."""
    low, high = values, values
    for axis in range(3):
        low, high = _windows(low, size, axis).min(-1), _windows(high, size, axis).max(-1)
    return low, high


def _points_of_blocks(blocks: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Mask (X, Y, Z) of all points that belong to the given blocks."""
    points = np.zeros(shape, bool)
    points[:-1, :-1, :-1] = np.kron(blocks, np.ones((BLOCK,) * 3, bool))
    for axis in range(3):  # the far faces
        view = np.moveaxis(points, axis, 0)
        far = view[BLOCK - 1 : -1 : BLOCK]
        view[BLOCK::BLOCK] |= far
    return points
