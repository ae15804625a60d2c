"""PLY files said plainly: triangles alone, and a picture that is there.

trimesh fans every polygon out, reads binary files only where all faces have the same number of corners, and passes over a picture
that is missing.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from charnerf.errors import DataError
from charnerf.surfaces.foreign_files import check_picture
from charnerf.surfaces.polygons import triangulate

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"), **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"), **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"), **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"), **dict.fromkeys(("double", "float64"), "f8"),
    "int64": "i8", "uint64": "u8", "float16": "f2",
}  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class _Property:
    """A number, or a list whose length has a type of its own."""

    name: str
    kind: str
    count_kind: str | None = None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]

    @property
    def row(self) -> np.dtype | None:
        """Type of a row without lists."""
        if any(each.count_kind for each in self.properties):
            return None
        return np.dtype([(each.name, each.kind) for each in self.properties])


def check_texture(content: bytes, neighbour: Callable[[str], bytes]) -> None:
    """Check that the picture that a PLY file names is there.

    Raises:
        DataError: If it is missing or broken.
    """
    header = content[: content.find(b"end_header")].decode("utf-8", errors="replace")
    for name in re.findall(r"^comment\s+texturefile\s+(.+)$", header, re.MULTILINE | re.IGNORECASE):
        check_picture(neighbour(name.strip()), name.strip())


def plain_faces(content: bytes) -> bytes:
    """A PLY file whose faces are triangles; as it is where it holds no other, or is none of vertices before faces.

    Raises:
        DataError: If a face names a vertex that is not there, or the file is cut short.
    """
    end = content.find(b"\n", content.find(b"end_header")) + 1
    header = content[:end].decode("utf-8", errors="replace")
    is_text = "format ascii" in header
    elements = _elements(header, ">" if "binary_big_endian" in header else "<")
    if [element.name for element in elements[:2]] != ["vertex", "face"] or elements[0].row is None:
        return content
    vertex, face = elements[:2]
    corners = next((index for index, each in enumerate(face.properties) if each.name in _CORNERS), None)
    if corners is None:
        return content
    body = content[end:]
    if not is_text and _only_triangles(body, vertex, face):
        return content
    if is_text:
        vertices, rows, before, after = _read_text(body, vertex, face)
    else:
        vertices, rows, before, after = _read_binary(body, vertex, face)
    polygons = [np.asarray(row[corners], dtype=np.int64) for row in rows]
    if all(len(polygon) == 3 for polygon in polygons):
        return content
    rows, polygons = zip(
        *((row, each) for row, each in zip(rows, polygons, strict=True) if len(each) > 2), strict=True
    )
    cut = [
        [_of_corners(value, len(polygon), triangle) for value in row]
        for row, polygon, triangles in zip(rows, polygons, triangulate(vertices, polygons), strict=True)
        for triangle in triangles
    ]
    header = re.sub(r"element\s+face\s+\d+", f"element face {len(cut)}", header)
    write = _text_row if is_text else _binary_row
    return header.encode() + before + b"".join(write(row, face.properties) for row in cut) + after


def _elements(header: str, order: str) -> list[_Element]:
    elements: list[_Element] = []
    for words in (line.split() for line in header.splitlines()):
        if words[:1] == ["element"]:
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1].properties.append(
                _Property(words[4], order + _TYPES[words[3]], order + _TYPES[words[2]])
            )
        elif words[:1] == ["property"]:
            elements[-1].properties.append(_Property(words[2], order + _TYPES[words[1]]))
    return elements


def _only_triangles(body: bytes, vertex: _Element, face: _Element) -> bool:
    """Whether a binary file is surely one of triangles, seen at once rather than face by face."""
    fields: list[Any] = []
    for each in face.properties:
        if each.count_kind is not None:
            fields.append((f"{each.name}_count", each.count_kind))
        fields.append((each.name, each.kind, (3,) if each.count_kind is not None else ()))
    counts = [name for name, *_ in fields if name.endswith("_count")]
    row, start = np.dtype(fields), vertex.count * vertex.row.itemsize if vertex.row is not None else 0
    if len(counts) != 1 or len(body) < start + face.count * row.itemsize:
        return False
    return bool((np.frombuffer(body, row, face.count, start)[counts[0]] == 3).all())


def _read_text(
    body: bytes, vertex: _Element, face: _Element
) -> tuple[np.ndarray, list[list[Any]], bytes, bytes]:
    """Positions, rows of faces (a value or list for each property), and the bytes before and after the faces."""
    lines = body.splitlines(keepends=True)
    last = vertex.count + face.count
    if len(lines) < last:
        raise DataError(f"found {len(lines)} lines of numbers, expected {last}; it is cut short.")
    places = [[each.name for each in vertex.properties].index(axis) for axis in "xyz"]
    table = [line.split() for line in lines[: vertex.count]]
    vertices = np.array([[row[place] for place in places] for row in table], dtype=np.float64).reshape(-1, 3)
    rows = []
    for line in lines[vertex.count : last]:
        words, at, row = line.split(), 0, list[Any]()
        for each in face.properties:
            if each.count_kind is None:
                row.append(words[at])
                at += 1
            else:
                count = int(words[at])
                row.append(words[at + 1 : at + 1 + count])
                if len(row[-1]) < count:
                    raise DataError("a face has fewer corners than it says; the file is cut short.")
                at += 1 + count
        rows.append(row)
    return vertices, rows, b"".join(lines[: vertex.count]), b"".join(lines[last:])


def _read_binary(
    body: bytes, vertex: _Element, face: _Element
) -> tuple[np.ndarray, list[list[Any]], bytes, bytes]:
    """The same of a binary file."""
    table = np.frombuffer(body, vertex.row, vertex.count)
    vertices = np.stack([table[axis] for axis in "xyz"], axis=-1).astype(np.float64)
    start = at = table.nbytes
    rows = []
    for _ in range(face.count):
        row: list[Any] = []
        for each in face.properties:
            count = 1
            if each.count_kind is not None:
                count = int(np.frombuffer(body, each.count_kind, 1, at)[0])
                at += np.dtype(each.count_kind).itemsize
            values = np.frombuffer(body, each.kind, count, at)
            at += values.nbytes
            row.append(values if each.count_kind is not None else values[0])
        rows.append(row)
    return vertices, rows, body[:start], body[at:]


def _of_corners(value: Any, size: int, triangle: np.ndarray) -> Any:
    """What a property of a polygon says of one triangle of it: lists hold so many values a corner."""
    if np.ndim(value) == 0 or len(value) % size:
        return value
    each = len(value) // size
    return [value[corner * each + index] for corner in triangle for index in range(each)]


def _text_row(row: list[Any], properties: list[_Property]) -> bytes:
    words: list[bytes] = []
    for value, each in zip(row, properties, strict=True):
        words += [value] if each.count_kind is None else [b"%d" % len(value), *value]
    return b" ".join(words) + b"\n"


def _binary_row(row: list[Any], properties: list[_Property]) -> bytes:
    parts = []
    for value, each in zip(row, properties, strict=True):
        if each.count_kind is not None:
            parts.append(np.array(len(value), each.count_kind).tobytes())
        parts.append(np.array(value, each.kind).tobytes())
    return b"".join(parts)
