"""A data set on disk and generated characters beside it, as `data=joined` names them."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import final

from charnerf.capture.generated_data import AbstractGeneratedData
from charnerf.capture.people_data import PeopleData
from charnerf.capture.procedural_data import ProceduralData
from charnerf.capture.shapes_data import ShapesData
from charnerf.data.base import AbstractData
from charnerf.data.folder import FolderData
from charnerf.data.layout import DatasetInfo, read_dataset, write_dataset
from charnerf.errors import ConfigError, DataError
from charnerf.files import cache_folder, locked

JOINED_SPLIT = "train"  # that generated characters join


@final
class JoinedData(AbstractData):
    """A data set whose split `train` generated characters join; nothing is written into its folder, or copied.

    Args:
        root: Folder of the data set, with dataset.json.
        embedded: Embedded characters that join.
        shapes: Shapes without meaning that join.
        people: People that join.
        assets: Folder of what people are made of; None without people.
        seed: Of what is generated.
        size: Side of its pictures, pixels.
        views: Target pictures of each.
        cache: Folder for what is generated; None for charnerf's folder in the user's cache.
    """

    def __init__(
        self,
        *,
        root: str,
        embedded: int,
        shapes: int,
        people: int,
        assets: str | None,
        seed: int,
        size: int,
        views: int,
        cache: str | None,
    ) -> None:
        counts = {"embedded": embedded, "shapes": shapes, "people": people}
        if min(counts.values()) < 0 or not any(counts.values()):
            raise ConfigError(
                f"data.{', data.'.join(counts)}: found {', '.join(map(str, counts.values()))}, expected 0 or more, and one"
                " of them more than 0; without, take data=folder."
            )
        if people and not assets:
            raise ConfigError(
                "data.assets: not set, expected the folder that people are made of; docs/generators.md."
            )
        kinds: dict[str, Callable[..., AbstractGeneratedData]] = {
            "embedded": ProceduralData,
            "shapes": ShapesData,
            "people": partial(PeopleData, assets=assets or ""),
        }
        self._folder = FolderData(root=root)
        self._generated = {
            name: kinds[name](train=count, val=0, test=0, seed=seed, size=size, views=views, cache=cache)
            for name, count in counts.items()
            if count
        }
        self._cache = cache_folder(cache)

    def check_image_size(self, size: int) -> None:
        """Check those of the data set's first character and of all that is generated."""
        for data in (self._folder, *self._generated.values()):
            data.check_image_size(size)

    def split_sizes(self) -> Mapping[str, int]:
        """Those of the data set, with what joins."""
        sizes = dict(self._folder.split_sizes())
        joining = sum(data.train for data in self._generated.values())
        return {**sizes, JOINED_SPLIT: sizes.get(JOINED_SPLIT, 0) + joining}

    def check_splits(self, *, train: Sequence[str], val: str, test: str) -> None:
        """Check that each has characters, and that what is generated is trained on."""
        super().check_splits(train=train, val=val, test=test)
        if JOINED_SPLIT not in train or JOINED_SPLIT in (val, test):
            raise ConfigError(
                f"splits: found train={list(train)}, val={val}, test={test}, expected {JOINED_SPLIT!r} in train alone: what is"
                " generated joins it."
            )

    def prepare(self, *, depth: bool = False) -> Path:
        """Generate what is missing, and join it by links in a folder of the cache.

        Args:
            depth: Whether a loss reads captured depth.

        Raises:
            DataError: If a name is taken, or a folder can not be read or made.
        """
        folder = self._folder.prepare(depth=depth).resolve()
        generated = {name: data.prepare(depth=depth) for name, data in self._generated.items()}
        info = read_dataset(folder)
        homes = {name: folder / name for names in info.splits.values() for name in names}
        joining = {
            f"{kind}-{name.removeprefix(f'{JOINED_SPLIT}-')}": root / name
            for kind, root in generated.items()
            for name in read_dataset(root).splits[JOINED_SPLIT]
        }
        taken = sorted(homes.keys() & joining.keys())
        if taken:
            raise DataError(
                f"{folder}: already holds {', '.join(taken)}; rename them, what is generated has these names."
            )
        text = json.dumps([str(folder), *map(str, generated.values())])
        root = self._cache / f"joined-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
        splits = {**info.splits, JOINED_SPLIT: (*info.splits.get(JOINED_SPLIT, ()), *joining)}
        root.mkdir(parents=True, exist_ok=True)
        with locked(root):
            _link(root, {**homes, **joining})
            write_dataset(
                DatasetInfo(root=root, splits=splits, made_by={**info.made_by, "joined": sorted(generated)})
            )
        return root


def _link(root: Path, homes: Mapping[str, Path]) -> None:
    """Links to characters, by their names."""
    for name, home in homes.items():
        link = root / name
        if link.is_symlink() and link.readlink() == home:
            continue
        try:
            link.unlink(missing_ok=True)
            link.symlink_to(home, target_is_directory=True)
        except OSError as err:
            raise DataError(
                f"{link}: can not be made a link to {home} ({err}), expected a file system with links; name another one by"
                " data.cache."
            ) from err
