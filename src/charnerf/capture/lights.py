"""How the captured surface is lit; the paper assumes constant light, which is `Unlit`."""

from abc import ABC, abstractmethod
from typing import final

import numpy as np


class AbstractLight(ABC):
    """A light changes the colours of surface points before they are averaged over a pixel.

    Attributes:
        constant: Share of it that comes from everywhere, in [0, 1]; the rest comes from the camera.
    """

    constant: float

    @abstractmethod
    def lit(self, rgb: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Linear colours (K, 3) as lit.

        Args:
            rgb: Linear base colours, (K, 3).
            normals: Unit normals of the triangles, (K, 3), of either side.
            directions: Unit directions of the camera's rays, (K, 3).
        """


@final
class Unlit(AbstractLight):
    """Base colours as they are."""

    constant = 1.0

    def lit(self, rgb: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the base colours."""
        return rgb


@final
class Headlight(AbstractLight):
    """A matt surface under light from the camera, plus constant light."""

    def __init__(self, constant: float = 0.5):
        """Set the share of constant light, in [0, 1]."""
        self.constant = constant

    def lit(self, rgb: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Darken what is seen at a slant."""
        facing = np.abs((normals * directions).sum(axis=-1, keepdims=True))
        return rgb * (self.constant + (1.0 - self.constant) * facing)
