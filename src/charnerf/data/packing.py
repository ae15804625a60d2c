"""Data sets packed into shards."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from charnerf.data.digest import training_digest
from charnerf.data.layout import MESH_FILE, read_dataset
from charnerf.data.shards import INDEX_FILE, Index, Shard, write_shard
from charnerf.errors import DataError
from charnerf.files import write_text


def pack(root: Path, output: Path, *, shard_mib: float, packed: Callable[[int], object]) -> Index:
    """Write a data set as shards; index.json comes last, so that what was interrupted is no data set.

    Characters of a split are dealt into shards in a random order, always the same one: neighbours have nothing in common, so that
    training may draw from a few shards at a time.

    Args:
        root: The data set.
        output: Folder for the shards, new or empty.
        shard_mib: Size that a shard reaches before the next begins, MiB.
        packed: Told how many characters each shard holds.

    Raises:
        DataError: If the data set can not be read, or there are other files in the folder.
        DependencyError: If webdataset is not installed.
    """
    info = read_dataset(root)
    if output.exists() and any(output.iterdir()):
        raise DataError(f"{output}: is not empty, expected a new folder for the shards.")
    shards: list[Shard] = []
    digests = {split: training_digest(root, split) for split, names in info.splits.items() if names}
    done: set[str] = set()
    for place, names in enumerate(info.splits.values()):
        order = np.random.default_rng(place).permutation(len(names))
        dealt = [root / names[index] for index in order if names[index] not in done]
        done |= set(names)
        for folders in _bundles(dealt, shard_mib * 2**20):
            shards.append(write_shard(output / f"{len(shards):06d}.tar", folders))
            packed(len(folders))
    with_mesh = frozenset(name for name in done if (root / name / MESH_FILE).is_file())
    index = Index(info.splits, info.made_by, digests, tuple(shards), with_mesh)
    write_text(output / INDEX_FILE, index.text())
    return index


def _bundles(folders: Sequence[Path], most: float) -> list[list[Path]]:
    """Folders in their order, each bundle of about so many bytes."""
    bundles: list[list[Path]] = []
    size = most
    for folder in folders:
        if size >= most:
            bundles.append([])
            size = 0.0
        bundles[-1].append(folder)
        size += sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    return bundles
