"""Where a run's data set comes from."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path

from charnerf.errors import ConfigError


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
    def split_sizes(self) -> Mapping[str, int]:
        """Numbers of characters by split, known before any work.

        Raises:
            DataError: If the data set can not be read.
        """

    def check_splits(self, *, train: Sequence[str], val: str, test: str) -> None:
        """Check, before any work, that the splits of a run have characters; the last is read after training.

        Raises:
            ConfigError: If one has none.
            DataError: If the data set can not be read.
        """
        sizes = self.split_sizes()
        for key, split in [*(("train", name) for name in train), ("val", val), ("test", test)]:
            if not sizes.get(split):
                problem = "is empty" if split in sizes else "does not exist"
                there = ", ".join(f"{name} ({size})" for name, size in sizes.items()) or "none"
                raise ConfigError(f"splits.{key}: split {split!r} {problem}; its splits are: {there}.")

    @abstractmethod
    def prepare(self, *, depth: bool = False) -> Path:
        """Make what is missing, and return the data set's folder.

        Args:
            depth: Whether a loss reads captured depth.

        Raises:
            DataError: If it can not be made or read.
        """
