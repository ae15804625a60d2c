"""Data sets in shards: tar files of many characters each, from a folder, HTTP or S3, unpacked into a bounded cache when asked for.

    SHARDS/index.json          format, version, splits, how it was made, digests, which shard holds a character
    SHARDS/000000.tar ...      WebDataset's: a sample is a character, its members are its files, / written as %2F

A cache is a data set as any other (layout.py) whose characters come when they are opened and go, the longest unused shard first,
when it is full. WebDataset writes and reads the tar files; fsspec, which torch brings along, fetches them.
"""

import hashlib
import io
import json
import os
import shutil
import tarfile
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from charnerf.data.layout import DATASET_FILE, DatasetInfo, check_name, read_json, write_dataset
from charnerf.data.partial import character_aside, whole_characters
from charnerf.errors import DataError, DependencyError
from charnerf.files import inside, locked, write_bytes, write_text

FORMAT, VERSION = "charnerf-shards", 1
INDEX_FILE, CACHE_FILE = "index.json", "cache.json"
MOST_INDEX = 256 * 2**20  # bytes
MOST_SHARD = 4 * 2**30
MOST_FILES = 100_000  # of a character
CACHE_MIB = 20480.0  # of commands' caches
_LOCK, _USED = ".cache.lock", ".used-"
_TAR_MAGIC = slice(257, 262)


@dataclass(frozen=True)
class Shard:
    """A tar file: its name, size in bytes, SHA-256, and its characters in order."""

    file: str
    size: int
    sha256: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Index:
    """What index.json says.

    Attributes:
        splits: Names of characters by split.
        made_by: How it was made.
        digests: By split, of what is trained on.
        shards: The tar files.
        with_mesh: Characters that have a mesh.
    """

    splits: dict[str, tuple[str, ...]]
    made_by: dict[str, Any]
    digests: dict[str, str]
    shards: tuple[Shard, ...]
    with_mesh: frozenset[str]

    def shard_of(self, name: str) -> Shard:
        """The shard that holds a character.

        Raises:
            DataError: If none does.
        """
        for shard in self.shards:
            if name in shard.names:
                return shard
        raise DataError(f"{INDEX_FILE}: no shard holds the character {name!r}; pack the data set again.")

    def text(self) -> str:
        """As a file."""
        shards = [{**vars(shard), "names": list(shard.names)} for shard in self.shards]
        content = {
            "format": FORMAT,
            "version": VERSION,
            "splits": {split: list(names) for split, names in self.splits.items()},
            "made_by": self.made_by,
            "digests": self.digests,
            "with_mesh": sorted(self.with_mesh),
            "shards": shards,
        }
        return json.dumps(content, indent=1) + "\n"


def read_index(file: Path) -> Index:
    """Read an index.json.

    Raises:
        DataError: If it is none, or names a file or character wrongly.
    """
    content = read_json(file)
    if content.get("format") != FORMAT or content.get("version") != VERSION:
        raise DataError(
            f"{file}: found {content.get('format')!r} of version {content.get('version')!r}, expected {FORMAT!r} of {VERSION};"
            " make it by `charnerf pack`."
        )
    try:
        index = Index(
            splits={str(split): tuple(map(str, names)) for split, names in content["splits"].items()},
            made_by=dict(content["made_by"]),
            digests={str(split): str(digest) for split, digest in content["digests"].items()},
            shards=tuple(
                Shard(str(one["file"]), int(one["size"]), str(one["sha256"]), tuple(map(str, one["names"])))
                for one in content["shards"]
            ),
            with_mesh=frozenset(map(str, content["with_mesh"])),
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise DataError(
            f"{file}: can not be read ({type(error).__name__}: {error}); pack the data set again."
        ) from error
    for shard in index.shards:
        check_name(f"{file}: shard", shard.file)
        if not 0 < shard.size <= MOST_SHARD:
            raise DataError(f"{file}: {shard.file}: found {shard.size} bytes, expected 1 to {MOST_SHARD}.")
        for name in shard.names:
            check_name(f"{file}: {shard.file}: character", name)
    return index


def write_shard(file: Path, folders: Sequence[Path]) -> Shard:
    """Pack characters' folders into one tar, whole or not at all; the same folders make the same bytes.

    Raises:
        DependencyError: If webdataset is not installed.
    """
    buffer = io.BytesIO()
    writer = _webdataset().TarWriter(buffer, encoder=False, mtime=0.0, user="", group="", format="PAX_FORMAT")
    for place, folder in enumerate(folders):
        files = sorted(one for one in folder.rglob("*") if one.is_file() and not one.name.startswith("."))
        members = {quote(one.relative_to(folder).as_posix(), safe=""): one.read_bytes() for one in files}
        writer.write({"__key__": f"{place:06d}", **members})
    writer.close()
    content = buffer.getvalue()
    write_bytes(file, content)
    return Shard(
        file.name, len(content), hashlib.sha256(content).hexdigest(), tuple(one.name for one in folders)
    )


def open_cache(address: str, home: Path, limit_mib: float) -> Path:
    """Make, or find, the cache of a data set in shards: a data set whose characters are not there yet.

    Args:
        address: Folder, http(s):// or s3:// address that holds index.json.
        home: Folder for such caches.
        limit_mib: Bound on the unpacked shards, MiB; one shard is always kept.

    Returns:
        The cache's folder.

    Raises:
        DataError: If the index can not be read.
        DependencyError: If the package for such addresses is not installed.
    """
    content = _fetch(f"{address.rstrip('/')}/{INDEX_FILE}", MOST_INDEX)
    name = hashlib.sha256(address.encode() + content).hexdigest()[:12]
    root = home / f"shards-{name}"
    root.mkdir(parents=True, exist_ok=True)
    with locked(root / _LOCK):
        write_bytes(root / INDEX_FILE, content)
        index = read_index(root / INDEX_FILE)
        write_text(root / CACHE_FILE, json.dumps({"address": address, "limit_mib": limit_mib}) + "\n")
        if not (root / DATASET_FILE).is_file():
            write_dataset(DatasetInfo(root, index.splits, {**index.made_by, "shards": address}))
    return root


def is_cache(root: Path) -> bool:
    """Whether a data set is a cache of shards."""
    return (root / CACHE_FILE).is_file()


def bring(root: Path, name: str) -> None:
    """Have a character of a cache unpacked; others that were unused the longest may go.

    Raises:
        DataError: If its shard can not be fetched, is not what the index says, or holds other files than a character's.
    """
    index = read_index_once(root)
    shard = index.shard_of(name)
    used = root / f"{_USED}{shard.file}"
    if (root / name).is_dir():
        with suppress(FileNotFoundError):  # it is on its way out
            _note_use(used)
            return
    with locked(root / _LOCK), whole_characters(root):
        if not ((root / name).is_dir() and used.is_file()):
            settings = read_json(root / CACHE_FILE)
            _make_room(root, index, float(settings["limit_mib"]) * 2**20 - shard.size)
            _unpack(root, shard, _fetch(f"{str(settings['address']).rstrip('/')}/{shard.file}", shard.size))
        used.touch()
        _note_use(used)


def _note_use(file: Path) -> None:
    """Note that a shard was used now; the system's own times are too coarse to tell two uses apart."""
    now = time.time_ns()
    os.utime(file, ns=(now, now))


_indices: dict[tuple[Path, int], Index] = {}


def read_index_once(root: Path) -> Index:
    """The index of a cache, which never changes: its folder is named after it."""
    key = (root, (root / INDEX_FILE).stat().st_mtime_ns)
    if key not in _indices:
        _indices.clear()
        _indices[key] = read_index(root / INDEX_FILE)
    return _indices[key]


def _make_room(root: Path, index: Index, limit: float) -> None:
    """Remove the shards that were unused the longest until the others take no more than a limit, bytes."""
    there = [shard for shard in index.shards if (root / f"{_USED}{shard.file}").is_file()]
    there.sort(key=lambda shard: (root / f"{_USED}{shard.file}").stat().st_mtime_ns)
    while there and sum(shard.size for shard in there) > limit:
        gone = there.pop(0)
        (root / f"{_USED}{gone.file}").unlink(missing_ok=True)
        for name in gone.names:
            shutil.rmtree(root / name, ignore_errors=True)


def _unpack(root: Path, shard: Shard, content: bytes) -> None:
    """Write the characters of a shard, each aside and then renamed."""
    where = f"{root}: {shard.file}"
    if len(content) != shard.size or hashlib.sha256(content).hexdigest() != shard.sha256:
        raise DataError(
            f"{where}: found {len(content)} other bytes than {INDEX_FILE} says; pack or copy the shards again."
        )
    if content[_TAR_MAGIC] != b"ustar":
        raise DataError(f"{where}: found no plain tar file, expected one of `charnerf pack`.")
    samples = list(_samples(content, where))
    if len(samples) != len(shard.names):
        raise DataError(
            f"{where}: found {len(samples)} characters, expected {len(shard.names)}; pack the data set again."
        )
    for name, members in zip(shard.names, samples, strict=True):
        with character_aside(root, name) as aside:
            for member, body in members.items():
                file = inside(aside, member, where)
                try:
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_bytes(body)
                except (FileExistsError, IsADirectoryError, NotADirectoryError) as error:
                    raise DataError(
                        f"{where}: found {member[:200]!r} as a file and as a folder, expected one of them."
                    ) from error
            shutil.rmtree(root / name, ignore_errors=True)


def _samples(content: bytes, where: str) -> Iterator[dict[str, bytes]]:
    """Files of the characters of a tar, by their paths."""
    reader = _webdataset().tariterators
    try:
        _check_plain(content, where)
        files = ({**one, "__url__": where} for one in reader.tar_file_iterator(io.BytesIO(content)))
        for sample in reader.group_by_keys(files, lcase=False):
            members = {unquote(key): body for key, body in sample.items() if not key.startswith("__")}
            if len(members) > MOST_FILES:
                raise DataError(
                    f"{where}: found a character of {len(members)} files, expected at most {MOST_FILES}."
                )
            yield members
    except Exception as error:  # tar files of strangers fail in every way
        if isinstance(error, DataError):
            raise
        raise DataError(
            f"{where}: can not be read ({type(error).__name__}: {error}); pack the data set again."
        ) from error


def _check_plain(content: bytes, where: str) -> None:
    """Check that a tar holds files alone, whose bytes are there: the gaps of a sparse one may fill the memory."""
    with tarfile.open(fileobj=io.BytesIO(content), mode="r:") as members:
        for one in members:
            if not one.isfile() or one.issparse():
                raise DataError(f"{where}: found {one.name[:200]!r}, which is no plain file.")


def _fetch(address: str, most: int) -> bytes:
    """Content of a file in a folder, at an http(s) or an s3 address.

    Raises:
        DataError: If it is not there, or larger than `most` bytes.
        DependencyError: If the package for such addresses is not installed.
    """
    import fsspec

    try:
        with fsspec.open(address, "rb") as stream:
            content = stream.read(most + 1)
    except ImportError as error:
        raise DependencyError(f"{address}: {error}. Install it: pip install 'charnerf[shards]'.") from error
    except Exception as error:  # each file system has its own
        raise DataError(
            f"{address}: can not be fetched ({type(error).__name__}: {error}), expected a file of `charnerf pack`."
        ) from error
    if len(content) > most:
        raise DataError(f"{address}: found more than {most} bytes, expected fewer.")
    return bytes(content)


def _webdataset() -> Any:
    try:
        import webdataset
    except ImportError as error:
        raise DependencyError(
            "data=shards and `charnerf pack` need the package webdataset: pip install 'charnerf[shards]'."
        ) from error
    return webdataset
