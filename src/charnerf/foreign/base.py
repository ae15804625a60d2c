"""What a format of data sets says of its characters."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from charnerf.foreign.shot import Shot

NO_SPLITS = "test"
"""The split of characters of a set that tells none: measuring works at once, training on them has to be asked for."""

Up = Literal["+z", "+y", "-y"]


@dataclass(frozen=True)
class Found:
    """A character of a foreign data set.

    Attributes:
        name: What it is called here.
        split: Its split.
        folder: Where it lies; every file that it names lies in here.
        part: Which part of the folder's files it is, where one folder holds several characters.
    """

    name: str
    split: str
    folder: Path
    part: str = ""


class AbstractFormat(ABC):
    """A way to lay out pictures with cameras.

    Attributes:
        title: Its name in messages.
        up: Axis of its worlds that points up.
    """

    title: str
    up: Up

    @abstractmethod
    def characters(self, root: Path) -> list[Found]:
        """The characters of a folder, none where it is of another format.

        Raises:
            DataError: If a list of characters can not be read.
        """

    @abstractmethod
    def shots(self, one: Found) -> list[Shot]:
        """Pictures with cameras of a character, in the order that numbers of views count.

        Raises:
            DataError: If a file is missing or wrong; the message names file and key.
        """


def found_in(folders: Iterable[Path], split: str = NO_SPLITS) -> list[Found]:
    """Characters of folders, by the folders' names."""
    return [Found(name=name_of(folder.name), split=split, folder=folder) for folder in folders]


def name_of(text: str) -> str:
    """A name as data sets of ours hold them: other signs than letters, digits and _ - + . become _."""
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text).lstrip(".-+") or "character"


def folders_in(folder: Path) -> list[Path]:
    """Visible folders in a folder, by name."""
    return sorted(one for one in folder.iterdir() if one.is_dir() and not one.name.startswith("."))
