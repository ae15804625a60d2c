"""Checkpoint files: torch's zip archives with a checksum in the archive's comment, where torch reads them as ever."""

import hashlib
import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from charnerf.errors import DataError
from charnerf.files import open_regular, sync_folder, write_aside, write_synced

_MARK = b"charnerf-sha256:"
_SEAL_SIZE = len(_MARK) + 2 * hashlib.sha256().digest_size
_NO_COMMENT = b"\0\0"  # the last bytes of a zip archive: the size of its comment


def write_checkpoint(path: Path, content: Mapping[str, Any], *, keep: Path | None = None) -> None:
    """Write a checkpoint beside its place, wait until it is on the disk, and rename it.

    Args:
        path: The file.
        content: Tensors, numbers and names.
        keep: What was at `path` before goes there, in the place of what was there.

    Raises:
        DataError: If it can not be written; what was at `path` stays.
    """
    buffer = io.BytesIO()
    torch.save(content, buffer)
    try:
        with write_aside(path) as aside:
            write_synced(aside, _sealed(buffer.getvalue()))
            if keep is not None and path.exists():
                os.replace(path, keep)
        sync_folder(path.parent)
    except OSError as error:
        raise DataError(
            f"{path}: the checkpoint can not be written ({error.strerror or error}), expected a folder with room that this"
            " user may write to; what was written before stays. Mend that, and go on with ckpt_path=last."
        ) from error


def read_checkpoint(path: Path, *, sealed: bool = True) -> dict[str, Any]:
    """Read a checkpoint on the CPU; it can hold tensors, numbers and names, and runs no code.

    Args:
        path: The file.
        sealed: Whether it has to have a checksum; one that it has is compared either way.

    Raises:
        DataError: If it can not be read, or a byte of it has changed.
    """
    try:
        with open_regular(path) as file:
            raw = file.read()
        if sealed or raw[-_SEAL_SIZE:].startswith(_MARK):
            _check_seal(raw)
        content = torch.load(io.BytesIO(raw), map_location="cpu", weights_only=True)
        if not isinstance(content, dict):
            raise TypeError(f"it holds a {type(content).__name__}")
    except DataError:
        raise
    except Exception as error:  # torch raises many kinds on files that are no checkpoints
        raise DataError(
            f"{path}: can not be read as a checkpoint ({' '.join(str(error).split())[:200]}), expected one"
            " that a run wrote."
        ) from error
    return content


def _sealed(archive: bytes) -> bytes:
    """A zip archive with its checksum as comment, which has to be whole itself."""
    assert archive.endswith(_NO_COMMENT)  # torch writes no comment
    body = archive[: -len(_NO_COMMENT)] + _SEAL_SIZE.to_bytes(2, "little")
    return body + _seal(body)


def _seal(body: bytes) -> bytes:
    return _MARK + hashlib.sha256(body).hexdigest().encode()


def _check_seal(raw: bytes) -> None:
    body, seal = raw[:-_SEAL_SIZE], raw[-_SEAL_SIZE:]
    if not seal.startswith(_MARK):
        raise ValueError("it has no checksum at its end: it is cut off, or of another program")
    if seal != _seal(body):
        raise ValueError("its checksum is another one: it was changed after it was written")
