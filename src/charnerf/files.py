"""Files that are there whole or not at all: written beside their place, then renamed into it; what may be read; and locks."""

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from charnerf.errors import DataError
from charnerf.interruption import held
from charnerf.wording import typed_or_clicked

_AT_ONCE = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)  # the opening of a pipe waits for nobody
# of a disk, of a user's share, of what a process may write
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)
MOST_TEXT = 64 * 2**20  # bytes of a file that is read whole, such as JSON


def open_regular(path: Path) -> BinaryIO:
    """Open a file for reading; a pipe, which may wait for ever, and a device, which may never end, are refused.

    Raises:
        DataError: If it is one of these, a folder, or its name can be no file's.
        OSError: If it can not be opened.
    """
    try:
        handle = os.open(path, os.O_RDONLY | _AT_ONCE)
    except ValueError as error:  # NUL, or half of a character
        raise DataError(f"{str(path)!r}: can not be a file's name ({error}).") from error
    except OSError as error:
        if error.errno == errno.ENXIO:
            raise DataError(f"{path}: found a socket or device, expected a file.") from error
        raise
    mode = os.fstat(handle).st_mode  # of what is open: the name may mean something else by now
    if not stat.S_ISREG(mode):
        os.close(handle)
        what = "a folder" if stat.S_ISDIR(mode) else "a pipe, socket or device"
        raise DataError(f"{path}: found {what}, expected a file.")
    return os.fdopen(handle, "rb")


def read_bytes(path: Path, *, most: int) -> bytes:
    """Content of a file.

    Raises:
        DataError: If it is no file, or larger than `most` bytes.
        OSError: If it can not be opened.
    """
    with open_regular(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise DataError(f"{path}: found more than {most} bytes, expected fewer.")
    return content


def read_text(path: Path, *, most: int = MOST_TEXT) -> str:
    """Content of a text file in UTF-8.

    Raises:
        DataError: If it is no file, or larger than `most` bytes.
        OSError: If it can not be opened.
        UnicodeDecodeError: If it is not UTF-8.
    """
    return read_bytes(path, most=most).decode("utf-8")


def inside(folder: Path, name: str, where: str) -> Path:
    """A file that a folder names, which lies in that folder; the folder itself may be a link, its files may not lead out.

    Args:
        folder: The folder.
        name: Relative to it.
        where: What a message names: the file and key that hold the name.

    Raises:
        DataError: If it lies elsewhere, also by a link, or can be no file's name.
    """
    try:
        home = folder.resolve()
        file = folder / name
        is_inside = not Path(name).is_absolute() and ".." not in Path(name).parts
        with suppress(FileNotFoundError, NotADirectoryError):
            file.stat()  # says whether the name is too long, or a loop of links
        if is_inside and file.resolve().is_relative_to(home):
            return file
    except (ValueError, OSError, RuntimeError) as error:  # NUL, too long, a loop of links
        raise DataError(
            f"{where}: found {name[:60]!r}, which is no file's name ({str(error)[:60]})."
        ) from error
    raise DataError(
        f"{where}: found {name[:200]!r}, which leads out of {folder}; expected a file inside it. Copy it there."
    )


def cache_folder(given: str | Path | None = None) -> Path:
    """The folder for what can be made again: a given one, its ~ expanded, else charnerf's in $XDG_CACHE_HOME or ~/.cache."""
    if given is not None:
        return Path(given).expanduser()
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "charnerf"


@contextmanager
def write_aside(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to: its file takes the place of `path` when the block ends, and goes if it raises.

    Readers see the old file or the new one, never a part. Folders that `path` lacks are made.

    Args:
        path: The file to write.

    Yields:
        A hidden name in the same folder that ends in .part, so that no search by suffix finds it; libraries that
        choose a format by suffix have to be given the format.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with named_in_errors(path, aside):
            yield aside
            os.replace(aside, path)
    finally:
        with suppress(OSError):  # it is not there, as on a disk that can not be written to
            aside.unlink()


def write_synced(path: Path, content: bytes) -> None:
    """Write a file and wait until it is on the disk: a rename after this survives a power cut with its content."""
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def sync_folder(path: Path) -> None:
    """Wait until the renames in a folder are on the disk, where the system can tell."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        return
    try:
        os.fsync(handle)
    except OSError:  # some network file systems sync no folders
        pass
    finally:
        os.close(handle)


@contextmanager
def named_in_errors(path: Path, aside: Path) -> Iterator[None]:
    """Let errors of the system name what is written, not the place aside; those of a full disk name nothing at all."""
    try:
        yield
    except OSError as error:
        if str(error.filename).startswith(str(aside)):
            error.filename = f"{path}{str(error.filename).removeprefix(str(aside))}"
        elif error.filename is None and error.errno in _NO_ROOM:
            error.filename = str(path)
        raise


def error_words(error: BaseException) -> str:
    """An error's message; of one of the system the file, what was found, what was expected, what to do."""
    if not isinstance(error, OSError):
        return str(error)
    where, found = error.filename or "the disk", error.strerror
    if error.errno in _NO_ROOM:
        return (
            f"{where}: can not be written to ({found}), expected room; what was written before is whole. Make room, and"
            f" {typed_or_clicked('give the same command', 'try')} again."
        )
    if error.errno in _NOT_ALLOWED:
        return f"{where}: can not be opened ({found}), expected to be allowed to. Change its permissions, or name another place."
    return str(error)


@contextmanager
def named_full_disk(folder: Path) -> Iterator[None]:
    """Name the folder that is written to where the disk is full; libraries say no more than that.

    Raises:
        DataError: If the disk, the user's share of it, or what a process may write is used up.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in _NO_ROOM:
            raise
        raise DataError(
            f"{folder}: can not be written to ({error.strerror}), expected room; what was written before stays. Make room, and"
            " go on with ckpt_path=last."
        ) from error


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a folder, or a file that is made for it, against other processes; the system frees the lock of a killed one."""
    try:
        import fcntl
    except ImportError:  # Windows: two processes at once are not guarded from each other
        yield
        return
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def is_locked(path: Path) -> bool:
    """Whether another process holds a lock file now; False where there is none, or the system knows no locks."""
    try:
        import fcntl
    except ImportError:
        return False
    if not path.is_file():
        return False
    handle = os.open(path, os.O_RDWR if os.access(path, os.W_OK) else os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)  # others may look at the same time
    except BlockingIOError:
        return True
    finally:
        os.close(handle)
    return False


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; halves of characters, as names of files may hold them, are escaped."""
    with write_aside(path) as aside:
        aside.write_text(text, encoding="utf-8", errors="backslashreplace")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with write_aside(path) as aside:
        aside.write_bytes(content)


def _is_there(path: Path) -> bool:
    """Whether there is anything by a name, a link to nothing too; OSError where no name can be so, as a too long one."""
    try:
        os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def check_folder(path: Path) -> None:
    """Check that a folder can be written to where a command is told to, before the work.

    Raises:
        DataError: If there, or above, is a file, or nothing can be written there: it is read only, full, or its name too long.
    """
    try:
        nearest = next(one for one in (path, *path.absolute().parents) if _is_there(one))
        if not nearest.is_dir():
            what = "a file" if nearest.exists() else "a link to nothing"
            raise DataError(f"{nearest}: found {what}, expected a folder to write to. Choose another.")
        with tempfile.TemporaryFile(dir=nearest) as file:
            file.write(b"x" * 4096)
    except OSError as error:
        raise DataError(
            f"{str(path)[:200]}: can not be written to ({error.strerror}), expected a folder with room. Choose another."
        ) from error


@contextmanager
def write_folder_aside(path: Path) -> Iterator[Path]:
    """A folder beside `path` to write into: when the block ends it becomes `path`, and it goes if the block raises.

    Where there is a folder already its pieces are replaced one by one, and others in it stay. Folders that `path` lacks are
    made.

    Args:
        path: The folder to write.

    Yields:
        A hidden folder in the same folder.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
    try:
        with named_in_errors(path, aside):
            yield aside
            with held():
                _put(aside, path)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _put(aside: Path, path: Path) -> None:
    """Let a folder take its place, or its pieces theirs where there is one."""
    if not path.exists():
        aside.chmod(0o755)
        aside.rename(path)
        return
    for piece in sorted(aside.iterdir()):
        _replace(piece, path / piece.name)


def _replace(piece: Path, target: Path) -> None:
    """Move a file or folder to where another one may be."""
    if target.is_dir() and not target.is_symlink():
        old = piece.with_name(f"{piece.name}.old")
        target.rename(old)
        piece.replace(target)
        shutil.rmtree(old)
    else:
        piece.replace(target)
