"""Data sets of embedded characters: generated once, kept in a cache folder, resumed if interrupted."""

import hashlib
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, final

import numpy as np

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_scene_to, made_by
from charnerf.capture.parallel import in_processes
from charnerf.data.base import AbstractData
from charnerf.data.characters import remove_partial_characters
from charnerf.data.layout import (
    DATASET_FILE,
    DatasetInfo,
    add_to_split,
    open_or_new,
    read_dataset,
    write_dataset,
)
from charnerf.errors import ConfigError, DataError
from charnerf.files import locked, user_cache
from charnerf.procedural import GENERATOR_VERSION, make_character
from charnerf.progress import Progress

SPLITS = ("train", "val", "test")
MOST_CHARACTERS = 3_000_000  # of a data set
_LOCK_FILE = ".generate.lock"


def character_seed(seed: int, split: str, index: int) -> int:
    """The seed of one character: 128 bits from the data set's seed, the split and the index.

    Args:
        seed: Seed of the data set, not negative.
        split: "train", "val" or "test".
        index: Number within the split.
    """
    words = np.random.SeedSequence(seed, spawn_key=(SPLITS.index(split), index)).generate_state(4, np.uint32)
    return int.from_bytes(words.astype("<u4").tobytes(), "little")


def generate_dataset(
    root: str | Path,
    train: int,
    val: int,
    test: int,
    seed: int,
    *,
    views: int = 48,
    size: int = 128,
    depth: bool = False,
    processes: int | None = None,
) -> DatasetInfo:
    """Write embedded characters as a data set; those that are there already are kept.

    Args:
        root: Folder, new or holding a data set that was made with the same seed and settings.
        train: Characters in the training split.
        val: In the validation split.
        test: In the test split.
        seed: Seed of the whole set; splits never share a character.
        views: Target pictures a character.
        size: Side of every picture, pixels.
        depth: Whether depth pictures are written too.
        processes: Worker processes; None for one a core.

    Returns:
        The data set.

    Raises:
        ConfigError: If a number is out of range.
        DataError: If the folder holds something else.
    """
    counts = {"train": train, "val": val, "test": test}
    _check_numbers({**counts, "seed": seed}, views=views, size=size)
    root, options = Path(root), CaptureOptions(views=views, size=size, depth=depth)
    facts = {
        **made_by(options),
        "generator": "procedural",
        "generator_version": GENERATOR_VERSION,
        "seed": seed,
    }
    root.mkdir(parents=True, exist_ok=True)
    with locked(root / _LOCK_FILE):  # one process generates, others wait
        wanted = [(split, index) for split, count in counts.items() for index in range(count)]
        _begin(root, wanted, facts)
        _make_missing(root, wanted, partial(_make, root=root, seed=seed, options=options), processes)
    return read_dataset(root)


@final
class ProceduralData(AbstractData):
    """Embedded characters in a cache folder, generated on first use.

    Args:
        train: Characters in the training split.
        val: In the validation split.
        test: In the test split.
        seed: Seed of the whole set.
        size: Side of every picture, pixels.
        views: Target pictures a character.
        cache: Folder for such data sets; None for charnerf's folder in the user's cache.
    """

    def __init__(
        self, *, train: int, val: int, test: int, seed: int, size: int, views: int, cache: str | None = None
    ) -> None:
        _check_numbers({"train": train, "val": val, "test": test, "seed": seed}, views=views, size=size)
        self._settings = {
            "train": train,
            "val": val,
            "test": test,
            "seed": seed,
            "size": size,
            "views": views,
        }
        self._cache = Path(cache).expanduser() if cache is not None else user_cache()

    @property
    def root(self) -> Path:
        """Where the data set is, or will be: its name tells every setting and the generator's version."""
        return self._root(self._settings)

    def _root(self, settings: dict[str, int]) -> Path:
        text = json.dumps({**settings, "generator_version": GENERATOR_VERSION}, sort_keys=True)
        return (
            self._cache / f"procedural-v{GENERATOR_VERSION}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
        )

    def check_image_size(self, size: int) -> None:
        """Check the size that characters are generated in."""
        generated = self._settings["size"]
        if generated != size:
            raise ConfigError(
                f"data.size: found {generated}, expected scale.image_size = {size}; leave data.size out, or set both."
            )

    def split_sizes(self) -> dict[str, int]:
        """As they will be generated."""
        return {split: self._settings[split] for split in SPLITS}

    def prepare(self, *, depth: bool = False) -> Path:
        """Generate what is missing; the data set's folder.

        Args:
            depth: Whether a loss reads captured depth: the same characters and pictures with depth, in a folder of their own.

        Raises:
            DataError: If the folder can not be made or holds something else.
        """
        root = self._root({**self._settings, "depth": True} if depth else self._settings)
        if not self._is_complete(root):
            generate_dataset(root, **self._settings, depth=depth)
        return root

    def _is_complete(self, root: Path) -> bool:
        if not (root / DATASET_FILE).is_file():
            return False
        splits = read_dataset(root).splits
        return all(
            len(splits.get(split, ())) == self._settings[split]
            and all((root / name).is_dir() for name in splits.get(split, ()))
            for split in SPLITS
        )


def _check_numbers(counts: dict[str, int], *, views: int, size: int) -> None:
    for name, value in counts.items():
        if value < 0:
            raise ConfigError(f"{name}: found {value}, expected 0 or more.")
    if sum(counts[split] for split in SPLITS) > MOST_CHARACTERS:
        raise ConfigError(f"train, val, test: expected at most {MOST_CHARACTERS} characters in all.")
    if sum(counts[split] for split in SPLITS) == 0:
        raise ConfigError("train, val, test: found 0 each, expected at least one character in all.")
    if views < 1 or size < 8:
        raise ConfigError(f"views, size: found {views} and {size}, expected views >= 1 and size >= 8 pixels.")


def _name(split: str, index: int) -> str:
    return f"{split}-{index:05d}"


def _begin(root: Path, wanted: Sequence[tuple[str, int]], facts: dict[str, Any]) -> None:
    """Make or check dataset.json, and list characters that an interrupted run wrote but did not list."""
    info = open_or_new(root)
    differing = [
        key for key, value in facts.items() if key != "program" and info.made_by.get(key, value) != value
    ]
    if differing or (info.splits and info.made_by.get("generator") != "procedural"):
        keys = ", ".join(differing) or "generator"
        raise DataError(
            f"{root}: holds a data set made otherwise ({keys}); name another folder or remove this one."
        )
    remove_partial_characters(root)
    splits: dict[str, tuple[str, ...]] = {}
    for split in SPLITS:
        mine = {_name(*pair) for pair in wanted if pair[0] == split and (root / _name(*pair)).is_dir()}
        kept = {name for name in info.splits.get(split, ()) if (root / name).is_dir()}
        splits[split] = tuple(sorted(kept | mine))
    write_dataset(DatasetInfo(root=root, splits=splits, made_by={**info.made_by, **facts}))


def _make_missing(
    root: Path,
    wanted: Sequence[tuple[str, int]],
    make: Callable[[tuple[str, int]], None],
    processes: int | None,
) -> None:
    """Make the characters whose folders are not there, in parallel, and add them to their splits."""
    missing = [pair for pair in wanted if not (root / _name(*pair)).is_dir()]
    if not missing:
        return
    with Progress("embedded characters") as progress:
        step = progress.counter(len(missing))
        for (split, index), _ in in_processes(make, missing, processes):
            add_to_split(root, split, [_name(split, index)])
            step()


def _make(pair: tuple[str, int], *, root: Path, seed: int, options: CaptureOptions) -> None:
    """Generate and capture one character."""
    capture_scene_to(root, _name(*pair), make_character(character_seed(seed, *pair)), options)
