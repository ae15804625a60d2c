"""A glTF 2.0 file in memory: its JSON, and all its buffers in one.

Libraries that map the JSON to classes leave accessors to their callers, so these are read here: strides, sparse values and
normalized integers included.
"""

import base64
import binascii
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np

from charnerf.errors import DataError
from charnerf.surfaces.foreign_files import check_gltf, read_whole

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
FLOAT = 5126
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", FLOAT: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class GltfDocument:
    """A glTF file whose buffers are joined to one.

    Attributes:
        tree: The JSON; its bufferViews all lie in buffer 0.
        content: Bytes of that buffer.
    """

    def __init__(self, tree: dict[str, Any], buffers: list[bytes]):
        self.tree = tree
        self.content = bytearray()
        starts = [self._append(buffer) for buffer in buffers]
        for view in tree.get("bufferViews", []):
            view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
            view["buffer"] = 0

    def accessor(self, index: int) -> np.ndarray:
        """Values of an accessor (count, width): floats, or integers that are not normalized as they are stored.

        Raises:
            DataError: If it reaches beyond its buffer view.
        """
        entry = self.tree["accessors"][index]
        count, width = entry["count"], _WIDTHS[entry["type"]]
        dtype = np.dtype(_TYPES[entry["componentType"]])
        if "bufferView" in entry:
            values = self._values(entry["bufferView"], entry.get("byteOffset", 0), (count, width), dtype)
        else:
            values = np.zeros((count, width), dtype)
        if sparse := entry.get("sparse"):
            where, what, changed = sparse["indices"], sparse["values"], sparse["count"]
            kind = np.dtype(_TYPES[where["componentType"]])
            rows = self._values(where["bufferView"], where.get("byteOffset", 0), (changed, 1), kind)[:, 0]
            if changed and rows.max() >= count:
                raise DataError(f"accessor {index}: sparse values for row {rows.max()} of {count}.")
            values[rows] = self._values(
                what["bufferView"], what.get("byteOffset", 0), (changed, width), dtype
            )
        if not entry.get("normalized") or dtype.kind == "f":
            return values
        return np.maximum(values / np.float64(np.iinfo(dtype).max), -1.0)

    def bytes_of_view(self, index: int) -> bytes:
        """The bytes of a buffer view."""
        view = self.tree["bufferViews"][index]
        return bytes(self.content[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])

    def add_view(self, content: bytes) -> int:
        """Append bytes as a buffer view and return its index."""
        views = self.tree.setdefault("bufferViews", [])
        views.append({"buffer": 0, "byteOffset": self._append(content), "byteLength": len(content)})
        return len(views) - 1

    def add_accessor(self, values: np.ndarray) -> int:
        """Append values (count, 1 to 4), integers as uint32 and others as float32, and return the accessor's index."""
        kind = 5125 if np.issubdtype(values.dtype, np.integer) else FLOAT
        accessors = self.tree.setdefault("accessors", [])
        accessors.append(
            {
                "bufferView": self.add_view(values.astype(_TYPES[kind]).tobytes()),
                "componentType": kind,
                "count": len(values),
                "type": "SCALAR" if values.shape[1] == 1 else f"VEC{values.shape[1]}",
            }
        )
        return len(accessors) - 1

    def to_glb(self) -> bytes:
        """The document as a GLB file."""
        self.tree["buffers"] = [{"byteLength": len(self.content)}]
        head = json.dumps(self.tree).encode()
        chunks = [(JSON_CHUNK, head + b" " * (-len(head) % 4)), (BINARY_CHUNK, bytes(self.content))]
        body = b"".join(struct.pack("<II", len(chunk), kind) + chunk for kind, chunk in chunks)
        return struct.pack("<4sII", b"glTF", 2, len(body) + 12) + body

    def _append(self, content: bytes) -> int:
        start = len(self.content)
        self.content += content + b"\0" * (-len(content) % 4)
        return start

    def _values(self, view_index: int, offset: int, shape: tuple[int, int], dtype: np.dtype) -> np.ndarray:
        view = self.tree["bufferViews"][view_index]
        row = shape[1] * dtype.itemsize
        stride = view.get("byteStride", row)
        if shape[0] and not 0 <= offset <= view["byteLength"] - (shape[0] - 1) * stride - row:
            raise DataError(f"buffer view {view_index}: {shape[0]} rows of {row} bytes do not fit into it.")
        return np.ndarray(
            shape, dtype, self.content, view["byteOffset"] + offset, (stride, dtype.itemsize)
        ).copy()


def read_gltf(path: Path, neighbour: Callable[[str], bytes]) -> GltfDocument:
    """Read a glTF or GLB file and its buffers.

    Args:
        path: The file.
        neighbour: Gives the bytes of a file that it names.

    Raises:
        DataError: If it is no glTF 2.0, is cut short, too large, or its nodes are no tree.
    """
    content, chunk = read_whole(path), None
    if content[:4] == b"glTF":
        content, chunk = _chunks(content)
    tree = json.loads(content)
    version = str(tree["asset"]["version"])
    if not version.startswith("2."):
        raise DataError(f"found glTF {version}, expected 2.0; export it again.")
    check_gltf(tree, path)
    buffers = []
    for index, entry in enumerate(tree.get("buffers", [])):
        if "uri" in entry:
            buffer = uri_bytes(entry["uri"], neighbour)
        elif index == 0 and chunk is not None:
            buffer = chunk
        else:
            holder = ", ".join(entry.get("extensions", {})) or "no uri"
            raise DataError(f"buffer {index} has no bytes of its own ({holder}); export it uncompressed.")
        if len(buffer) < entry["byteLength"]:
            raise DataError(
                f"found {len(buffer)} bytes in buffer {index}, expected {entry['byteLength']}; it is cut short."
            )
        buffers.append(buffer)
    return GltfDocument(tree, buffers)


def uri_bytes(uri: str, neighbour: Callable[[str], bytes]) -> bytes:
    """What a URI of a glTF file stands for: data in itself or a file beside it.

    Raises:
        DataError: If it is data that can not be decoded, or `neighbour` does.
    """
    if not uri.startswith("data:"):
        return neighbour(uri)
    head, _, data = uri.partition(",")
    try:
        return base64.b64decode(data) if head.endswith(";base64") else unquote_to_bytes(data)
    except binascii.Error as err:
        raise DataError(f"data URI {head}: can not be decoded ({err}).") from err


def _chunks(content: bytes) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB file."""
    _, version, _ = struct.unpack_from("<4sII", content)
    if version != 2:
        raise DataError(f"can not be read as a mesh (GLB version {version}, expected 2); export it again.")
    found: dict[int, bytes] = {}
    start = 12
    while start + 8 <= len(content):
        length, kind = struct.unpack_from("<II", content, start)
        found.setdefault(kind, content[start + 8 : start + 8 + length])
        start += 8 + length
    return found[JSON_CHUNK], found.get(BINARY_CHUNK)
