"""A data set in shards, as `data=shards` names it."""

from functools import cached_property
from pathlib import Path
from typing import final

from charnerf.data.base import AbstractData
from charnerf.data.characters import load_character
from charnerf.data.shards import open_cache, read_index_once
from charnerf.errors import ConfigError, DataError
from charnerf.files import cache_folder


@final
class ShardsData(AbstractData):
    """A data set that `charnerf pack` wrote, read shard by shard into a bounded cache.

    Args:
        root: Folder, or http(s):// or s3:// address, that holds index.json.
        cache: Folder for unpacked shards; None for charnerf's folder in the user's cache.
        cache_mib: Bound on them, MiB.
    """

    def __init__(self, *, root: str, cache: str | None, cache_mib: float) -> None:
        if not cache_mib > 0.0:
            raise ConfigError(f"data.cache_mib: found {cache_mib}, expected more than 0.")
        self.address, self.cache_mib = root, cache_mib
        self.cache = cache_folder(cache)

    @cached_property
    def _folder(self) -> Path:
        return open_cache(self.address, self.cache, self.cache_mib)

    def check_image_size(self, size: int) -> None:
        """Check the first character's drawings, which fetches its shard."""
        names = [name for members in read_index_once(self._folder).splits.values() for name in members]
        if not names:
            raise ConfigError(f"data.root: found no characters in '{self.address}', expected at least one.")
        cameras = load_character(self._folder, names[0]).sources.cameras
        needed = max(cameras.width, cameras.height)
        if needed != size:
            raise ConfigError(
                f"scale.image_size: found {size}, expected {needed}, the size of the drawings of {self.address} ({names[0]})."
                f" Set scale.image_size={needed}, or pack a data set of this size."
            )

    def split_sizes(self) -> dict[str, int]:
        """As index.json lists them."""
        return {split: len(names) for split, names in read_index_once(self._folder).splits.items()}

    def prepare(self, *, depth: bool = False) -> Path:
        """The cache's folder; characters come when they are opened.

        Args:
            depth: Whether a loss reads captured depth, step by step: what is read so has to stay.

        Raises:
            DataError: If the index can not be read, or depth is asked for.
        """
        if depth:
            raise DataError(
                f"{self.address}: depth is read at every step, expected a data set that stays: unpack it, or set the weight of"
                " loss.depth to 0."
            )
        return self._folder
