"""A short name for the content of a split: two people whose digests are equal measure on the same drawings."""

import hashlib
from pathlib import Path

from charnerf.data.characters import read_rgba
from charnerf.data.layout import TRANSFORMS_FILE, names_of, read_dataset
from charnerf.data.shards import is_cache, read_index_once
from charnerf.data.transforms import read_transforms

DIGITS = 16


def split_digest(root: str | Path, split: str) -> str:
    """Hexadecimal digest of a split: its names in order, and the names and pixels of their source views.

    Pixels, not files, so that another version of the PNG encoder makes no difference.

    Args:
        root: Folder of the data set.
        split: One of its splits.

    Raises:
        DataError: If the split is empty or a file is missing or unreadable.
    """
    digest = hashlib.sha256()
    for name in names_of(read_dataset(root), split):
        files = read_transforms(Path(root) / name)
        size = (files.source_cameras.width, files.source_cameras.height)
        for view, file in sorted(zip(files.source_names, files.source_files, strict=True)):
            digest.update(f"{name} {view} {size[0]}x{size[1]}\n".encode())
            digest.update(read_rgba(file, size).numpy().tobytes())
    return digest.hexdigest()[:DIGITS]


def training_digest(root: str | Path, split: str) -> str:
    """Hexadecimal digest of what is trained on: that of a split, and its characters' cameras and lists of pictures.

    Raises:
        DataError: If the split is empty or a file is missing or unreadable.
    """
    if is_cache(Path(root)):
        return read_index_once(Path(root)).digests[
            split
        ]  # written when it was packed; its shards are held to their own
    digest = hashlib.sha256(split_digest(root, split).encode())
    for name in names_of(read_dataset(root), split):
        digest.update((Path(root) / name / TRANSFORMS_FILE).read_bytes())
    return digest.hexdigest()[:DIGITS]
