"""Lenses that bend straight lines, and pictures without that: Brown's model as OpenCV and nerfstudio write it."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

from charnerf.errors import DataError

_RADII = 256  # checked for one another


@dataclass(frozen=True)
class Lens:
    """Radial coefficients k of r^2, r^4, r^6 and tangential ones p, of points at depth 1."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def distort(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where a lens shows what a pinhole shows at x, y (of depth 1, y down).

        Source: OpenCV, Camera Calibration and 3D Reconstruction, of the model without its rational part.
        """
        square = x * x + y * y
        radial = self._radial(square)
        return (
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (square + 2.0 * x * x),
            y * radial + self.p1 * (square + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )

    def is_one_to_one(self, radius: float) -> bool:
        """Whether radii up to one stay in their order, so that no point is shown twice."""
        radii = np.linspace(0.0, radius, _RADII)
        return bool((np.diff(radii * self._radial(radii * radii)) > 0.0).all())

    def _radial(self, square: np.ndarray) -> np.ndarray:
        return 1.0 + square * (self.k1 + square * (self.k2 + square * self.k3))


def undistorted(
    picture: Tensor, focal: tuple[float, float], centre: tuple[float, float], lens: Lens, where: str
) -> Tensor:
    """What a pinhole with the same focal lengths and centre shows, transparent where the lens does not reach.

    Args:
        picture: (H, W, C), colours times alpha.
        focal: Along x and y, pixels.
        centre: Principal point, pixels, pixel centres at +0.5.
        lens: Of the picture.
        where: What a message names.

    Raises:
        DataError: If the lens shows a point twice within the picture, so that its coefficients are wrong.
    """
    height, width = picture.shape[:2]
    rows, columns = np.meshgrid(np.arange(height) + 0.5, np.arange(width) + 0.5, indexing="ij")
    x, y = (columns - centre[0]) / focal[0], (rows - centre[1]) / focal[1]
    farthest = float(np.sqrt((x * x + y * y).max()))
    if not lens.is_one_to_one(farthest):
        raise DataError(
            f"{where}: found lens distortion {lens} that folds the picture, expected one that keeps radii in their order up to the"
            f" corners ({farthest:.3g}). Calibrate again, or undistort the pictures first."
        )
    bent_x, bent_y = lens.distort(x, y)
    at = np.stack((bent_y * focal[1] + centre[1], bent_x * focal[0] + centre[0])) - 0.5
    values = picture.numpy()
    bent = [
        ndimage.map_coordinates(values[..., one], at, order=1, mode="constant")
        for one in range(values.shape[-1])
    ]
    return torch.from_numpy(np.stack(bent, axis=-1).astype(np.float32))
