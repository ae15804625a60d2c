"""Generated characters in a cache folder, made on first use."""

import hashlib
import json
from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from charnerf.capture.generated import Generator, check_numbers, generate_dataset
from charnerf.data.base import AbstractData
from charnerf.data.layout import DATASET_FILE, read_dataset
from charnerf.errors import ConfigError
from charnerf.files import cache_folder


@dataclass(frozen=True, kw_only=True)
class AbstractGeneratedData(AbstractData):
    """Characters of a generator, as many as asked for; the name of their folder tells every setting.

    Attributes:
        train: Characters in the training split.
        val: In the validation split.
        test: In the test split.
        seed: Seed of the whole set.
        size: Side of every picture, pixels.
        views: Target pictures a character.
        cache: Folder for such data sets; None for charnerf's folder in the user's cache.
    """

    train: int
    val: int
    test: int
    seed: int
    size: int
    views: int
    cache: str | None = None

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ConfigError: If one is out of range.
        """
        check_numbers({**self.split_sizes(), "seed": self.seed}, views=self.views, size=self.size)

    @property
    @abstractmethod
    def generator(self) -> Generator:
        """What makes the characters.

        Raises:
            DataError: If it lacks files.
        """

    @property
    def root(self) -> Path:
        """Where the data set is, or will be."""
        return self._root(self._settings)

    @property
    def _settings(self) -> dict[str, int]:
        return {**self.split_sizes(), "seed": self.seed, "size": self.size, "views": self.views}

    def _root(self, settings: dict[str, int]) -> Path:
        generator = self.generator
        name, version = generator.name, generator.version
        facts: dict[str, Any] = {**settings, **generator.facts, "generator_version": version}
        digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:12]
        return cache_folder(self.cache) / f"{name}-v{version}-{digest}"

    def check_image_size(self, size: int) -> None:
        """Check the size that characters are generated in, and that the generator has what it needs."""
        if self.size != size:
            raise ConfigError(
                f"data.size: found {self.size}, expected scale.image_size = {size}; leave data.size out, or set both."
            )
        _ = self.generator

    def split_sizes(self) -> dict[str, int]:
        """As they will be generated."""
        return {"train": self.train, "val": self.val, "test": self.test}

    def prepare(self, *, depth: bool = False) -> Path:
        """Generate what is missing; the data set's folder.

        Args:
            depth: Whether a loss reads captured depth: the same characters and pictures with depth, in a folder of their own.

        Raises:
            DataError: If the folder can not be made or holds something else.
        """
        root = self._root({**self._settings, "depth": True} if depth else self._settings)
        if not self._is_complete(root):
            generate_dataset(root, **self._settings, generator=self.generator, depth=depth)
        return root

    def _is_complete(self, root: Path) -> bool:
        if not (root / DATASET_FILE).is_file():
            return False
        splits = read_dataset(root).splits
        return all(
            len(splits.get(split, ())) == count
            and all((root / name).is_dir() for name in splits.get(split, ()))
            for split, count in self.split_sizes().items()
        )
