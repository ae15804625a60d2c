"""OBJ files said plainly: absolute indices, no concave polygons, and all material files in one.

trimesh counts negative indices from the end of the file, fans every polygon out, reads the first `mtllib` alone, and passes over
what is missing.
"""

import re
from collections.abc import Callable

import numpy as np

from charnerf.errors import DataError
from charnerf.surfaces.foreign_files import check_picture
from charnerf.surfaces.polygons import triangulate

_NEEDS_WORK = re.compile(rb"^f[ \t]+(?:.*-|(?:\S+[ \t]+){3}\S)|\\\r?$", re.MULTILINE)
_KINDS = ("v", "vt", "vn")
_OPTION = re.compile(r"-(\w+)((?:\s+(?:on|off|[-+.\d][-+.\deE]*(?=\s)))+)\s+")
_NEUTRAL = {"s": 1.0, "o": 0.0, "t": 0.0}  # scale, offset and turbulence that leave a picture where it is


def plain_faces(content: bytes) -> bytes:
    """An OBJ file whose faces count from its beginning and are not concave.

    Raises:
        DataError: If a face names a vertex that is not there.
    """
    if not _NEEDS_WORK.search(content):
        return content
    text = re.sub(r"\\\r?\n", " ", content.decode("utf-8", errors="surrogateescape"))
    lines = text.splitlines()
    counts = dict.fromkeys(_KINDS, 0)
    positions: list[list[str]] = []
    faces: dict[int, list[str]] = {}
    for number, line in enumerate(lines):
        key, *values = line.split() or ("",)
        if key in counts:
            counts[key] += 1
            if key == "v":
                positions.append(values[:3])
        elif key == "f":
            values = line.partition("#")[0].split()[1:]
            faces[number] = [_absolute(corner, counts, number) for corner in values]
            lines[number] = " ".join(("f", *faces[number]))
    polygons = {number: corners for number, corners in faces.items() if len(corners) > 3}
    indices = [np.array([int(corner.split("/")[0]) - 1 for corner in each]) for each in polygons.values()]
    vertices = np.array(positions, dtype=np.float64).reshape(-1, 3)
    for (number, corners), triangles in zip(polygons.items(), triangulate(vertices, indices), strict=True):
        lines[number] = "\n".join("f " + " ".join(corners[place] for place in each) for each in triangles)
    return "\n".join([*lines, ""]).encode("utf-8", errors="surrogateescape")


def used_materials(content: bytes, neighbour: Callable[[str], bytes]) -> dict[str, bytes]:
    """The MTL entries of an OBJ's materials, by the name of the file that trimesh looks for; empty if it names none.

    Args:
        content: The OBJ.
        neighbour: Gives the bytes of a file beside it.

    Raises:
        DataError: If a material or its picture is missing, broken, or stretched by options.
    """
    text = content.decode("utf-8", errors="replace")
    libraries = [name.strip() for name in re.findall(r"^mtllib[ \t]+(.+)$", text, re.MULTILINE)]
    if not libraries:
        return {}
    entries: dict[str, list[str]] = {}
    current: list[str] = []
    for library in libraries:
        for line in _library(library, neighbour).decode("utf-8", errors="replace").splitlines():
            key, *values = line.split() or ("",)
            if key.lower() == "newmtl":
                current = entries.setdefault(" ".join(values), [])
            else:
                current.append(line)
    merged = []
    for name in sorted(
        {" ".join(name.split()) for name in re.findall(r"^usemtl[ \t]+(.+)$", text, re.MULTILINE)}
    ):
        if name not in entries:
            raise DataError(
                f"names material {name}, which {', '.join(libraries)} does not hold; export it again."
            )
        merged += [f"newmtl {name}", *(_plain_entry(line, name, neighbour) for line in entries[name])]
    return {libraries[0]: "\n".join(merged).encode()}


def _absolute(corner: str, counts: dict[str, int], number: int) -> str:
    """A face's corner v, v/vt, v//vn or v/vt/vn with indices from the beginning of the file."""
    if "-" not in corner:
        return corner
    indices = []
    for kind, index in zip(_KINDS, corner.split("/"), strict=False):
        absolute = int(index) + counts[kind] + 1 if index.startswith("-") else index
        if isinstance(absolute, int) and absolute < 1:
            raise DataError(
                f"line {number + 1}: {corner} counts back beyond the first {kind}; export it again."
            )
        indices.append(str(absolute))
    return "/".join(indices)


def _library(name: str, neighbour: Callable[[str], bytes]) -> bytes:
    """An MTL file, or several whose names stand in one line."""
    try:
        return neighbour(name)
    except DataError:
        if len(name.split()) < 2:
            raise
        return b"\n".join(neighbour(each) for each in name.split())


def _plain_entry(line: str, material: str, neighbour: Callable[[str], bytes]) -> str:
    """A line of a material; a picture's is checked and loses its options."""
    key, *rests = line.split(None, 1) or ("",)
    if key.lower() != "map_kd":
        return line
    rest = "".join(rests).strip()
    while option := _OPTION.match(rest):
        numbers = option[2].split()
        if option[1] in _NEUTRAL and any(float(number) != _NEUTRAL[option[1]] for number in numbers):
            raise DataError(
                f"material {material}: the option -{option[1]} of map_Kd is not read; export it without."
            )
        rest = rest[option.end() :]
    if not rest:
        return ""
    check_picture(neighbour(rest), rest)
    return f"map_Kd {rest}"
