"""Where a run's data set comes from."""

from abc import ABC, abstractmethod
from pathlib import Path


class AbstractData(ABC):
    """A data set that is there, or that is made on first use."""

    @abstractmethod
    def check_image_size(self, size: int) -> None:
        """Check, before any work, that the drawings are of the size that the model is trained for.

        Args:
            size: Of `scale.image_size`, pixels.

        Raises:
            ConfigError: If they are not, or there are none.
            DataError: If the data set can not be read.
        """

    @abstractmethod
    def prepare(self, *, depth: bool = False) -> Path:
        """Make what is missing, and return the data set's folder.

        Args:
            depth: Whether a loss reads captured depth.

        Raises:
            DataError: If it can not be made or read.
        """
