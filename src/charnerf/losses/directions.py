"""Along which direction surface points are looked at in training."""

from abc import ABC, abstractmethod
from typing import final

import torch
from torch import Tensor

from charnerf.geometry.safe import safe_normalize


class AbstractDirections(ABC):
    """A rule for the query directions of surface points."""

    @abstractmethod
    def __call__(self, points: Tensor, origins: Tensor, generator: torch.Generator) -> Tensor:
        """Choose directions.

        Args:
            points: (P, 3), m.
            origins: Of the training rays of the same character, (R, 3), m: where its cameras stand.
            generator: Randomness of the step and character, on the CPU.

        Returns:
            (P, 3), unit, or zero for "no direction".
        """


@final
class NoDirections(AbstractDirections):
    """Zero, as the paper."""

    def __call__(self, points: Tensor, origins: Tensor, generator: torch.Generator) -> Tensor:
        """Return zeros (P, 3)."""
        return torch.zeros_like(points)


@final
class RandomDirections(AbstractDirections):
    """Any direction, evenly over the sphere."""

    def __call__(self, points: Tensor, origins: Tensor, generator: torch.Generator) -> Tensor:
        """Return unit directions (P, 3)."""
        return safe_normalize(torch.randn(points.shape, generator=generator).to(points))


@final
class CameraDirections(AbstractDirections):
    """From a random camera of the step towards each point, whether it sees the point or not."""

    def __call__(self, points: Tensor, origins: Tensor, generator: torch.Generator) -> Tensor:
        """Return unit directions (P, 3)."""
        chosen = torch.randint(len(origins), (len(points),), generator=generator).to(origins.device)
        return safe_normalize(points - origins[chosen])
