"""Data sets of generated characters: each made of its own seed, in parallel; resumed if interrupted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_scene_to, made_by
from charnerf.capture.unfinished import listed_as_made
from charnerf.data.layout import DatasetInfo, add_to_split, open_or_new, read_dataset, write_dataset
from charnerf.errors import ConfigError, DataError
from charnerf.files import locked
from charnerf.parallel import in_processes
from charnerf.procedural import GENERATOR_VERSION, make_character
from charnerf.progress import Progress
from charnerf.surfaces.surface_mesh import SurfaceMesh

SPLITS = ("train", "val", "test")
MOST_CHARACTERS = 3_000_000  # of a data set
_LOCK_FILE = ".generate.lock"


@dataclass(frozen=True)
class Generator:
    """What makes a character of a seed, in the world frame; equal seeds give equal characters.

    Attributes:
        name: As data sets and messages name it.
        version: Raised whenever the characters of a seed change.
        make: Of a seed, any non-negative integer; can be sent to another process.
        facts: What else decides how the characters look.
    """

    name: str
    version: int
    make: Callable[[int], trimesh.Scene | SurfaceMesh]
    facts: Mapping[str, Any] = field(default_factory=dict)


EMBEDDED = Generator("procedural", GENERATOR_VERSION, make_character)


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
    generator: Generator = EMBEDDED,
    views: int = 48,
    size: int = 128,
    depth: bool = False,
    processes: int | None = None,
) -> DatasetInfo:
    """Write generated characters as a data set; those that are there already are kept.

    Args:
        root: Folder, new or holding a data set that was made with the same generator, seed and settings.
        train: Characters in the training split.
        val: In the validation split.
        test: In the test split.
        seed: Seed of the whole set; splits never share a character.
        generator: What makes them.
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
    check_numbers({**counts, "seed": seed}, views=views, size=size)
    root, options = Path(root), CaptureOptions(views=views, size=size, depth=depth)
    named = {"generator": generator.name, "generator_version": generator.version, "seed": seed}
    facts = {**made_by(options), **named, **generator.facts}
    root.mkdir(parents=True, exist_ok=True)
    with locked(root / _LOCK_FILE):  # one process generates, others wait
        wanted = [(split, index) for split, count in counts.items() for index in range(count)]
        _begin(root, wanted, facts)
        make = partial(_make, root=root, seed=seed, options=options, generator=generator)
        _make_missing(root, wanted, make, processes)
    return read_dataset(root)


def check_numbers(counts: Mapping[str, int], *, views: int, size: int) -> None:
    """Check how many characters and pictures are asked for.

    Args:
        counts: By split, and the seed.
        views: Target pictures a character.
        size: Side of every picture, pixels.

    Raises:
        ConfigError: If one is out of range.
    """
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
    if differing or (info.splits and info.made_by.get("generator") != facts["generator"]):
        keys = ", ".join(differing) or "generator"
        raise DataError(
            f"{root}: holds a data set made otherwise ({keys}); name another folder or remove this one."
        )
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
    names, add = [_name(*pair) for pair in missing], partial(_add, root)
    with (
        listed_as_made(root, names, add) as ended,
        Progress("generate") as progress,
        in_processes(make, missing, processes) as made,
    ):
        step = progress.counter(len(missing))
        for pair, _ in made:
            ended(_name(*pair), True)
            step()


def _add(root: Path, names: Sequence[str]) -> None:
    """Add characters to the splits that their names begin with."""
    for split in SPLITS:
        members = [name for name in names if name.startswith(f"{split}-")]
        if members:
            add_to_split(root, split, members)


def _make(
    pair: tuple[str, int], *, root: Path, seed: int, options: CaptureOptions, generator: Generator
) -> None:
    """Generate and capture one character."""
    capture_scene_to(root, _name(*pair), generator.make(character_seed(seed, *pair)), options)
