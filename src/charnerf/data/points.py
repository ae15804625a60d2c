"""What training points of a character are drawn from."""

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import torch

Points_co = TypeVar("Points_co", covariant=True)


class AbstractPoints(ABC, Generic[Points_co]):
    """Somewhere to draw points of one kind from."""

    @abstractmethod
    def sample(self, num_points: int, generator: torch.Generator) -> Points_co:
        """Draw points.

        Args:
            num_points: P, how many.
            generator: Randomness, on the CPU; the same state gives the same points.

        Returns:
            Points with B = 1, float32.
        """

    @property
    @abstractmethod
    def size_bytes(self) -> int:
        """Memory of what is kept to draw from, beside the character's pictures and hull."""
