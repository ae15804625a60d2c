"""What holds mesh files of others to their own folder, to ordinary pictures and to sizes that fit."""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import trimesh
from PIL import Image

from charnerf.errors import DataError
from charnerf.files import inside, read_bytes
from charnerf.pictures import check_pixels, open_picture, readable_formats

MOST_BYTES = 2**30  # of a file, or of one that it names
MOST_VALUES = 2**28  # numbers of a glTF accessor
MOST_NODES = 100_000  # of a glTF file

_ONE_AT_A_TIME = threading.RLock()  # while Pillow's door is ours


class OwnFolder(trimesh.resolvers.FilePathResolver):
    """Files beside a mesh file, for trimesh, which passes over what it can not have: what was refused is kept.

    Args:
        file: The mesh file.
        refused: Takes why a file was refused.
        contents: What is given in place of files, by their names.
    """

    def __init__(self, file: Path, refused: list[str], contents: Mapping[str, bytes] | None = None) -> None:
        super().__init__(str(file.resolve()))
        self._file, self._refused, self._contents = file, refused, contents or {}

    def get(self, name: str) -> bytes:
        """Content of a file by the name, or the URI, that the mesh file has for it, or of one with its last name beside it.

        Raises:
            FileNotFoundError: If there is none.
            DataError: If it lies elsewhere, or is no file.
        """
        name, problem = name.strip(), None
        if name in self._contents:
            return self._contents[name]
        decoded = unquote(name).replace("\\", "/")
        for one in (name, name.lstrip("/"), decoded, decoded.split("/")[-1]):
            try:
                path = inside(self._file.parent, one, str(self._file))
                if one and path.exists():
                    return read_whole(path)
            except DataError as error:
                problem = error
        if problem is not None and _exists(self._file.parent, name):
            self._refused.append(str(problem))
            raise problem
        raise FileNotFoundError(name)


def check_gltf(header: dict[str, Any], file: Path) -> None:
    """Check that the nodes of a glTF file are a tree and that its accessors are of a size that fits.

    Raises:
        DataError: If they are not.
    """
    nodes, accessors = header.get("nodes", []), header.get("accessors", [])
    if not isinstance(nodes, list) or not isinstance(accessors, list) or len(nodes) > MOST_NODES:
        raise DataError(
            f"{file}: expected lists of at most {MOST_NODES} nodes and accessors; export it again."
        )
    for index, one in enumerate(accessors):
        count = one.get("count") if isinstance(one, dict) else None
        if type(count) is not int or not 0 <= count <= MOST_VALUES:
            raise DataError(
                f"{file}: accessors.{index}.count: found {str(count)[:60]}, expected at most {MOST_VALUES}."
            )
    parents: dict[Any, int] = {}
    for index, node in enumerate(nodes):
        for child in node.get("children", []) if isinstance(node, dict) else []:
            if type(child) is not int or child in parents or not 0 <= child < len(nodes):
                raise DataError(
                    f"{file}: nodes.{index}: the child {str(child)[:60]} is no node or has two parents."
                )
            parents[child] = index
    reached, waiting = 0, [index for index in range(len(nodes)) if index not in parents]
    while waiting:
        node = nodes[waiting.pop()]
        reached += 1
        waiting += node.get("children", []) if isinstance(node, dict) else []
    if reached < len(nodes):
        raise DataError(
            f"{file}: its nodes are their own children in a circle, expected a tree; export it again."
        )


def read_whole(file: Path) -> bytes:
    """Content of a file of at most MOST_BYTES.

    Raises:
        DataError: If it is larger, or no file.
    """
    return read_bytes(file, most=MOST_BYTES)


def check_picture(content: bytes, name: str) -> None:
    """Check that a mesh's picture is one, as far as its header says.

    Raises:
        DataError: If it can not be opened, or has too many pixels.
    """
    try:
        with open_picture(content, f"picture {name}"):
            pass
    except OSError as err:
        raise DataError(f"picture {name}: can not be read, expected PNG or JPEG; export it again.") from err


@contextmanager
def pictures_checked(name: str, refused: list[str]) -> Iterator[None]:
    """Within, Pillow opens for trimesh what we would: trimesh calls it with any bytes of a file, and passes over errors."""
    opened = 0

    def checked(source: Any, mode: Any = "r", formats: Any = None) -> Image.Image:
        nonlocal opened
        picture = original(source, mode, readable_formats())
        opened += picture.width * picture.height
        try:
            check_pixels(f"{name}: a picture in it", picture.size)
            check_pixels(f"{name}: its pictures together", (opened, 1))
        except DataError as error:
            refused.append(str(error))
            raise
        return picture

    with _ONE_AT_A_TIME:
        original, limit = Image.open, Image.MAX_IMAGE_PIXELS
        Image.open, Image.MAX_IMAGE_PIXELS = checked, None  # type: ignore[assignment]
        try:
            yield
        finally:
            Image.open, Image.MAX_IMAGE_PIXELS = original, limit


def _exists(folder: Path, name: str) -> bool:
    try:
        return (folder / name).exists()
    except (OSError, ValueError):
        return False
