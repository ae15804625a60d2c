"""The data set on disk: where its files lie, and reading and writing of dataset.json.

    DATASET/dataset.json            format, version, splits {name: [characters]}, how it was made
    DATASET/NAME/transforms.json    cameras, source views (see data/transforms.py)
    DATASET/NAME/{images,sources,poses,depth,mesh}/

Names of folders that begin with a dot are characters being written; nothing reads them.
"""

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from charnerf.data.json_values import check_commas
from charnerf.errors import DataError
from charnerf.files import locked, read_text, write_text

FORMAT = "charnerf-dataset"
VERSION = 1
DATASET_FILE = "dataset.json"
TRANSFORMS_FILE = "transforms.json"
MESH_FILE = "mesh/mesh.obj"

_VIEW_NAME = re.compile(r"[^/\\\x00-\x1f\x7f\ud800-\udfff]{1,100}")
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+-]{0,199}")  # file systems take 255 bytes


@dataclass(frozen=True)
class DatasetInfo:
    """What dataset.json says.

    Attributes:
        root: Folder of the data set.
        splits: Names of the characters by split, in order.
        made_by: How it was made: free facts such as the command, its options and versions.
    """

    root: Path
    splits: dict[str, tuple[str, ...]]
    made_by: dict[str, Any]


def check_name(kind: str, name: str) -> None:
    """Check that a name can be a folder or a split.

    Raises:
        DataError: If it can not.
    """
    if not _NAME.fullmatch(name):
        raise DataError(
            f"{kind} {name[:100]!r}: expected letters, digits and _ - + . only, 200 at most, not beginning with a dot; "
            f"rename it."
        )


def given_twice(names: Iterable[str]) -> list[str]:
    """Names that stand there more than once, sorted."""
    return sorted(name for name, count in Counter(names).items() if count > 1)


def check_view_name(where: str, name: str) -> None:
    """Check that the name of a source view can be a file's.

    Raises:
        DataError: If it can not.
    """
    if not _VIEW_NAME.fullmatch(name) or name.startswith("."):
        raise DataError(
            f"{where}: found the view {name[:100]!r}, expected a name such as front or 45,20; rename it."
        )


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file that holds one object.

    Raises:
        DataError: If the file is missing, unreadable or holds anything else.
    """
    try:
        text = read_text(path)
        check_commas(text.count(","), str(path))
        content = json.loads(text)
    except DataError:
        raise
    except FileNotFoundError as err:
        raise DataError(
            f"{path}: no such file; expected a data set as `charnerf capture` writes it."
        ) from err
    except (
        OSError,
        ValueError,
        RecursionError,
    ) as err:  # ValueError: no UTF-8, no JSON, numbers of thousands of digits
        raise DataError(f"{path}: can not be read as JSON ({err}); write it again.") from err
    if not isinstance(content, dict):
        raise DataError(f"{path}: found a JSON {type(content).__name__}, expected an object.")
    return content


def read_dataset(root: str | Path) -> DatasetInfo:
    """Read dataset.json of a data set.

    Raises:
        DataError: If it is missing, not a data set's, of another version, or names a split or character
            wrongly.
    """
    root = Path(root)
    path = root / DATASET_FILE
    content = read_json(path)
    if content.get("format") != FORMAT:
        raise DataError(
            f"{path}: found format {content.get('format')!r}, expected {FORMAT!r}; not a data set of "
            f"charnerf."
        )
    if content.get("version") != VERSION:
        raise DataError(
            f"{path}: found version {content.get('version')!r}, this charnerf reads version {VERSION}; "
            "install the charnerf that wrote it, or capture the characters again."
        )
    splits = content.get("splits")
    if not isinstance(splits, dict):
        raise DataError(f"{path}: splits: found {repr(splits)[:60]}, expected an object of lists of names.")
    for split, names in splits.items():
        check_name(f"{path}: split", split)
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise DataError(f"{path}: splits.{split}: found {repr(names)[:60]}, expected a list of names.")
        for name in names:
            check_name(f"{path}: splits.{split}: character", name)
        if twice := given_twice(names):
            raise DataError(
                f"{path}: splits.{split}: found {', '.join(twice)} more than once; keep each name once."
            )
    made_by = content.get("made_by", {})
    return DatasetInfo(
        root=root,
        splits={split: tuple(names) for split, names in splits.items()},
        made_by=made_by if isinstance(made_by, dict) else {"note": made_by},
    )


def names_of(info: DatasetInfo, split: str) -> tuple[str, ...]:
    """Names of the characters of a split.

    Raises:
        DataError: If there is no such split or it is empty.
    """
    names = info.splits.get(split, ())
    if not names:
        filled = ", ".join(f"{name} ({len(members)})" for name, members in info.splits.items()) or "none"
        problem = "is empty" if split in info.splits else "does not exist"
        raise DataError(f"{info.root / DATASET_FILE}: split {split!r} {problem}; its splits are: {filled}.")
    return names


def write_dataset(info: DatasetInfo) -> None:
    """Write dataset.json, atomically; the folder is made if need be."""
    for split in info.splits:
        check_name("split", split)
    info.root.mkdir(parents=True, exist_ok=True)
    content = {
        "format": FORMAT,
        "version": VERSION,
        "splits": {split: list(names) for split, names in info.splits.items()},
        "made_by": info.made_by,
    }
    write_text(info.root / DATASET_FILE, json.dumps(content, indent=1) + "\n")


def open_or_new(root: str | Path) -> DatasetInfo:
    """Read a data set, or describe an empty one where the folder is missing or empty.

    Raises:
        DataError: If the folder holds other things but no dataset.json, or a broken one.
    """
    root = Path(root)
    if (root / DATASET_FILE).exists():
        return read_dataset(root)
    if root.exists() and not root.is_dir():
        raise DataError(f"{root}: is a file, expected a folder for the data set; name another one.")
    if root.exists() and any(not path.name.startswith(".") for path in root.iterdir()):
        raise DataError(
            f"{root}: is not empty and has no {DATASET_FILE}; expected a data set or a new folder."
        )
    return DatasetInfo(root=root, splits={}, made_by={})


def refuse_taken_names(info: DatasetInfo, names: Iterable[str]) -> None:
    """Check that new names are good, distinct and not yet in the data set.

    Raises:
        DataError: If one is not; the message names all of them.
    """
    names = list(names)
    for name in names:
        check_name("character", name)
    if twice := given_twice(names):
        raise DataError(f"{', '.join(twice)}: given more than once; names are file stems and must differ.")
    listed = {name: split for split, members in info.splits.items() for name in members}
    taken = [name for name in names if name in listed or (info.root / name).exists()]
    if taken:
        what = ", ".join(
            f"{name} (split {listed[name]})" if name in listed else f"{name} (in no split)" for name in taken
        )
        raise DataError(
            f"{info.root}: already holds {what}; rename the file, remove that folder, or use another "
            f"data set."
        )


def add_to_split(
    root: str | Path, split: str, names: Sequence[str], *, made_by: Mapping[str, Any] | None = None
) -> DatasetInfo:
    """Add characters, whose folders are there, to a split of a data set.

    Args:
        root: Folder of the data set; made if missing.
        split: Split to add to.
        names: Characters; none may be in the data set's lists yet. A split is kept sorted, so that it does
            not depend on which of several processes ended first.
        made_by: Facts about how they were made, merged into what is there.

    Returns:
        The data set as it is now.

    Raises:
        DataError: If a name is listed already or the data set can not be read.
    """
    root = Path(root)
    root.mkdir(parents=True, exist_ok=True)
    check_name("split", split)
    with locked(root):  # against other processes that add to it
        path = root / DATASET_FILE
        info = read_dataset(root) if path.exists() else DatasetInfo(root=root, splits={}, made_by={})
        listed = {name for members in info.splits.values() for name in members}
        again = [name for name in names if name in listed]
        if again:
            raise DataError(f"{path}: already lists {', '.join(again)}; names must differ.")
        splits = {**info.splits, split: tuple(sorted((*info.splits.get(split, ()), *names)))}
        info = DatasetInfo(root=root, splits=splits, made_by={**info.made_by, **(made_by or {})})
        write_dataset(info)
    return info
