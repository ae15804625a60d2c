"""TensorBoard's event files, read without its library's checksums: also while they are written."""

import struct
from collections.abc import Iterator
from pathlib import Path

from google.protobuf.message import DecodeError
from tensorboard.compat.proto.event_pb2 import Event

PATTERN = "events.out.tfevents.*"
_LENGTH, _CHECKSUM = struct.Struct("<Q"), 4  # of a record: length, checksum of it, content, checksum of that


def event_files(folder: Path) -> list[Path]:
    """Event files of a folder, the oldest first."""
    return sorted(folder.glob(PATTERN))


def read_events(file: Path) -> Iterator[tuple[bytes, Event]]:
    """Events with their bytes, up to one that is half written or damaged.

    Raises:
        OSError: If it can not be read.
    """
    content, start = memoryview(file.read_bytes()), 0
    while start + _LENGTH.size <= len(content):
        (length,) = _LENGTH.unpack_from(content, start)
        begin = start + _LENGTH.size + _CHECKSUM
        start = begin + length + _CHECKSUM
        if start > len(content):
            return
        record = bytes(content[begin : begin + length])
        try:
            yield record, Event.FromString(record)
        except DecodeError:
            return
