"""Densities on a grid, asked where a surface passes and nowhere else, and the optical depths that they make.

Letters: P points; N cameras averaged over; X, Y, Z grid points along the axes. A cell is the cube between eight grid points; a
block is a cube of `BLOCK` cells a side and shares its outer points with its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import final

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

from charnerf.errors import DataError
from charnerf.meshing.density import CHUNK, averaged_density
from charnerf.meshing.grid import Grid
from charnerf.meshing.optical_depth import surface_values
from charnerf.scene import Scene
from charnerf.types import LeftOut

BLOCK = 4  # cells a side
ACTIVE_SHARE = 0.02  # a block counts as near the surface from this share of its optical depth on: what lies before it adds to that


@final
class GridSampler:
    """Fills a grid of densities piece by piece and remembers what was evaluated.

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
        low, high = _occupied_box(scene)
        self.spacing = float((high - low).max()) / (resolution - 3)
        self.origin = low - self.spacing
        cells = np.ceil((high - low) / self.spacing - 1e-9).astype(int) + 2
        cells = -(-cells // BLOCK) * BLOCK  # whole blocks
        self.shape: tuple[int, int, int] = tuple(int(c) + 1 for c in cells)  # type: ignore[assignment]
        self.values = np.zeros(self.shape, np.float32)
        self.settled = np.zeros(self.shape, bool)  # evaluated, or empty by definition
        self.settled[~self._inside()] = True
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
        """Evaluate the points of a mask (X, Y, Z) that are not settled yet."""
        index = np.argwhere(wanted & ~self.settled)
        for start in range(0, len(index), CHUNK):
            part = index[start : start + CHUNK]
            densities = averaged_density(self._scene, self._points(part), self._num_cameras)
            self.values[tuple(part.T)] = densities.cpu().numpy()
            self._on_points(len(part))
        self.settled[tuple(index.T)] = True
        self.num_evaluated += len(index)

    def evaluate_all(self) -> Grid:
        """Optical depths by every point inside the hull."""
        self.evaluate(np.ones(self.shape, bool))
        return self._depths()

    def evaluate_surface(self, depth: float) -> Grid:
        """Optical depths, by the blocks that the surface at a depth passes through and by every second point elsewhere.

        Blocks are found by the optical depths of every second point, and then along the surface: where it leaves an evaluated
        block its neighbour is evaluated too, until it leaves none.

        Args:
            depth: Optical depth of the surface.
        """
        lattice = self._every_second()
        low, high = _block_extremes(surface_values(lattice, 2 * self.spacing), BLOCK // 2)
        active = (high >= ACTIVE_SHARE * depth) & (low < depth)
        done = np.zeros_like(active)
        while True:
            self.evaluate(_points_of_blocks(active & ~done, self.shape))
            done |= active
            self._fill_rest(lattice)
            grid = self._depths()
            active = self._entered_from(done, grid.values > depth)
            if not bool(active.any()):
                return grid

    def _every_second(self) -> np.ndarray:
        """Densities of every second point along each axis, evaluated."""
        every = (slice(None, None, 2),) * 3
        wanted = np.zeros(self.shape, bool)
        wanted[every] = True
        self.evaluate(wanted)
        return self.values[every].copy()

    def _entered_from(self, done: np.ndarray, above: np.ndarray) -> np.ndarray:
        """Blocks into which the surface leads from evaluated ones: a shared face has points above it and others."""
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

    def _fill_rest(self, lattice: np.ndarray) -> None:
        """Give points of blocks without surface the values between their settled neighbours."""
        rest = ~self.settled
        if rest.any():
            at = np.argwhere(rest).T / 2.0
            self.values[rest] = ndimage.map_coordinates(lattice, at, order=1, mode="nearest")

    def _left_out(self) -> LeftOut:
        total = int(np.prod(self.shape))
        return LeftOut(grid_cells=total - self.num_evaluated, grid_cells_of=total)

    def _depths(self) -> Grid:
        depths = surface_values(self.values, self.spacing)
        return Grid(depths, self.origin, self.spacing, self._left_out())


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
