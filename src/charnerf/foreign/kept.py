"""Foreign data sets as folders of ours, kept in the user's cache: what is read once need not be undistorted and measured again."""

import hashlib
import logging
import shutil
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from charnerf.data.characters import write_character
from charnerf.data.layout import DATASET_FILE, DatasetInfo, given_twice, write_dataset
from charnerf.data.partial import whole_characters
from charnerf.errors import CharNeRFError, DataError
from charnerf.files import cache_folder, locked, write_text
from charnerf.foreign.base import AbstractFormat, Found
from charnerf.foreign.co3d import Co3d
from charnerf.foreign.convert import converted
from charnerf.foreign.nmr import Nmr
from charnerf.foreign.reading import Reading
from charnerf.foreign.shot import Shot
from charnerf.foreign.srn import Srn
from charnerf.foreign.transforms_json import TransformsJson
from charnerf.parallel import in_processes
from charnerf.progress import Progress

log = logging.getLogger(__name__)

FORMATS: tuple[AbstractFormat, ...] = (TransformsJson(), Srn(), Nmr(), Co3d())
READER_VERSION = 1  # another one reads kept characters anew
_FINGERPRINT = ".read-from"
_LOCK = ".read.lock"
_SHOWN_ERRORS = 10


def is_ours(root: Path) -> bool:
    """Whether a folder is a data set of charnerf."""
    return (root / DATASET_FILE).is_file()


def recognised(root: Path) -> tuple[AbstractFormat, list[Found]]:
    """The format of a foreign data set, and its characters.

    Raises:
        DataError: If the folder is of no format, or two of its characters would have one name.
    """
    for one in FORMATS:
        found = one.characters(root)
        if found:
            if twice := given_twice(character.name for character in found):
                raise DataError(
                    f"{root}: found {', '.join(twice[:5])} more than once, expected one folder a name; rename them."
                )
            return one, found
    titles = "; ".join(one.title for one in FORMATS)
    raise DataError(f"{root}: found no data set, expected {DATASET_FILE} or one of: {titles}.")


def kept_copy(
    root: Path, reading: Reading, *, cache: Path | None = None, processes: int | None = None
) -> Path:
    """Folder of ours with the characters of a foreign data set; made where it is missing, mended where files have changed.

    Args:
        root: The foreign data set; nothing is written there.
        reading: How it is read.
        cache: Folder for such copies; None for charnerf's folder in the user's cache.
        processes: Worker processes; None for one a core.

    Raises:
        DataError: If it is of no format, or characters can not be read: all of them are named, the others are kept.
    """
    form, found = recognised(root)
    home = cache_folder(cache) / _folder_name(root, reading)
    home.mkdir(parents=True, exist_ok=True)
    with locked(home / _LOCK), whole_characters(home):  # one process reads, others wait
        work = partial(_keep, home=home, form=form, reading=reading)
        errors = []
        with Progress(f"read {root.name}") as progress, in_processes(work, found, processes) as results:
            step = progress.counter(len(found))
            for _, error in results:
                step()
                errors += [error] if error else []
        if errors:
            shown = "\n  ".join(sorted(errors)[:_SHOWN_ERRORS])
            raise DataError(f"{root}: {len(errors)} of {len(found)} characters can not be read:\n  {shown}")
        _list(home, root, form, found)
    return home


def _keep(one: Found, *, home: Path, form: AbstractFormat, reading: Reading) -> str | None:
    """Keep a character, unless it is there and none of its files has changed; the message of what is wrong, or None."""
    try:
        shots = form.shots(one)
        fingerprint, folder = _fingerprint(shots), home / one.name
        note = folder / _FINGERPRINT
        if note.is_file() and note.read_text() == fingerprint:
            return None
        pictures = converted(shots, form.up, reading)
        shutil.rmtree(folder, ignore_errors=True)
        write_character(home, one.name, pictures)
        write_text(note, fingerprint)
    except CharNeRFError as error:
        text = str(error)
        return text if str(one.folder) in text else f"{one.folder}: {text}"
    return None


def _fingerprint(shots: Sequence[Shot]) -> str:
    """Changes with the cameras and with the state of the files."""
    digest = hashlib.sha256(str(READER_VERSION).encode())
    for shot in shots:
        states = [
            (file.stat().st_size, file.stat().st_mtime_ns)
            for file in (shot.file, shot.mask)
            if file is not None
        ]
        digest.update(repr((shot, states)).encode("utf-8", "backslashreplace"))
    return digest.hexdigest()


def _folder_name(root: Path, reading: Reading) -> str:
    text = repr((str(root.resolve()), reading, READER_VERSION))
    return f"foreign-{hashlib.sha256(text.encode('utf-8', 'backslashreplace')).hexdigest()[:12]}"


def _list(home: Path, root: Path, form: AbstractFormat, found: Sequence[Found]) -> None:
    splits: dict[str, list[str]] = {}
    for one in found:
        splits.setdefault(one.split, []).append(one.name)
    facts = {"read_from": str(root.resolve()), "format": form.title}
    write_dataset(DatasetInfo(home, {split: tuple(sorted(names)) for split, names in splits.items()}, facts))
