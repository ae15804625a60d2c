"""One character of a data set: its pictures, cameras, source views and mesh, read and written."""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from charnerf.data.layout import MESH_FILE, TRANSFORMS_FILE, check_name, read_dataset
from charnerf.data.partial import character_aside
from charnerf.data.shards import bring, is_cache
from charnerf.data.transforms import read_transforms, transforms_text
from charnerf.errors import DataError
from charnerf.files import inside
from charnerf.geometry.framing import SOURCE_ORDER
from charnerf.pictures import open_picture
from charnerf.types import Cameras, SourceViews
from charnerf.wording import listed

MOST_NAMES = 12  # in a message

DEPTH_FOLDER = "depth"


@dataclass(frozen=True)
class Character:
    """A character on disk; its pictures are read when asked for.

    Attributes:
        name: Its name in the data set.
        folder: Its folder.
        cameras: Target cameras (N,), float32.
        image_files: RGBA pictures, N of them.
        depth_files: 16-bit pictures of depth in mm, N of them or none.
        sources: Source views with B = 1, V in the order front, side, back, then any other.
        source_names: Names of the V source views.
        mesh_file: Mesh for surface sampling, None where the data set has pictures and cameras only.
    """

    name: str
    folder: Path
    cameras: Cameras
    image_files: tuple[Path, ...]
    depth_files: tuple[Path, ...]
    sources: SourceViews
    source_names: tuple[str, ...]
    mesh_file: Path | None

    def images(self, indices: Sequence[int]) -> Tensor:
        """Pictures of some cameras, uint8 (n, H, W, 4): RGBA, sRGB-encoded, straight alpha.

        Raises:
            DataError: If a file is unreadable or not of the size that transforms.json says.
        """
        size = (self.cameras.width, self.cameras.height)
        return torch.stack([read_rgba(self.image_files[index], size) for index in indices])

    def depths(self, indices: Sequence[int]) -> Tensor:
        """Depth along the camera's axis at pixel centres, float32 (n, H, W), m; 0 where nothing is met.

        Raises:
            DataError: If the character has no depth files, or one is unreadable or of another size.
        """
        if not self.depth_files:
            raise DataError(
                f"{self.folder}: has no depth pictures, expected them because a term of the loss reads depth; capture the character"
                " again by `charnerf capture --depth`, or set its weight to 0."
            )
        size = (self.cameras.width, self.cameras.height)
        return torch.stack([_read_depth(self.depth_files[index], size) for index in indices])


@dataclass(frozen=True)
class CharacterPictures:
    """What is written of a character: pictures with their cameras.

    Attributes:
        cameras: Pinhole cameras (N,).
        images: uint8 (N, H, W, 4).
        source_cameras: Cameras (V,).
        source_images: uint8 (V, H, W, 4).
        source_names: V names.
        depths: uint16 (N, H, W), mm, or None.
    """

    cameras: Cameras
    images: np.ndarray
    source_cameras: Cameras
    source_images: np.ndarray
    source_names: tuple[str, ...]
    depths: np.ndarray | None = None

    @property
    def source_views(self) -> SourceViews:
        """The source views as models read them, B = 1."""
        return _source_views(torch.from_numpy(self.source_images), self.source_cameras.to(torch.float32))


def _absent(root: Path, name: str) -> DataError:
    """What to say of a character that is not there: names of the data set, those like it first."""
    names = sorted({one for split in read_dataset(root).splits.values() for one in split})
    if name in names:
        return DataError(
            f"{root / name}: no such folder, expected the character {name!r}; capture it or take it out of the split."
        )
    like = difflib.get_close_matches(name, names, n=3)
    shown = listed([*like, *(one for one in names if one not in like)], MOST_NAMES)
    return DataError(
        f"{root}: found no character {name!r}, expected one of the data set's: {shown or 'it has none'}."
    )


def load_character(root: str | Path, name: str, *, num_sources: int = 1) -> Character:
    """Open a character of a data set.

    Args:
        root: Folder of the data set.
        name: The character's name.
        num_sources: How many source views it must have at least.

    Raises:
        DataError: If a file is missing or unreadable, a picture has another size than its file says, a
            matrix is wrong, or there are
            fewer source views than asked.
    """
    check_name("character", name)
    folder = Path(root) / name
    if is_cache(Path(root)):
        bring(Path(root), name)
    if not folder.is_dir():
        raise _absent(Path(root), name)
    files = read_transforms(folder)
    if len(files.source_names) < num_sources:
        raise DataError(
            f"{folder / TRANSFORMS_FILE}: found {len(files.source_names)} source views "
            f"({', '.join(files.source_names)}), expected at least {num_sources}; capture it again or "
            f"ask for fewer."
        )
    order = sorted(range(len(files.source_names)), key=lambda index: _rank(files.source_names[index]))
    cameras = files.source_cameras[order]
    size = (cameras.width, cameras.height)
    images = torch.stack([read_rgba(files.source_files[index], size) for index in order])
    mesh_file = inside(folder, MESH_FILE, str(folder))
    return Character(
        name=name,
        folder=folder,
        cameras=files.cameras,
        image_files=files.image_files,
        depth_files=files.depth_files,
        sources=_source_views(images, cameras),
        source_names=tuple(files.source_names[index] for index in order),
        mesh_file=mesh_file if mesh_file.is_file() else None,
    )


def write_character(
    root: str | Path,
    name: str,
    pictures: CharacterPictures,
    *,
    write_mesh: Callable[[Path], None] | None = None,
) -> Path:
    """Write a character's folder aside, then rename it; dataset.json is left to `layout.add_to_split`.

    Args:
        root: Folder of the data set; made if missing.
        name: The character's name.
        pictures: Pictures and cameras.
        write_mesh: Writes the mesh to the file that it is given, if there is one.

    Returns:
        The character's folder.

    Raises:
        DataError: If the name is taken or can not be a folder's.
    """
    root = Path(root)
    check_name("character", name)
    target = root / name
    if target.exists():
        raise DataError(f"{target}: is there already; rename the character or remove that folder.")
    with character_aside(root, name) as aside:
        _write_pictures(aside, pictures)
        if write_mesh is not None:
            mesh_file = aside / MESH_FILE
            mesh_file.parent.mkdir()
            write_mesh(mesh_file)
    return target


def read_rgba(path: Path, size: tuple[int, int]) -> Tensor:
    """Read a picture as uint8 (H, W, 4); one without alpha is opaque everywhere.

    Args:
        path: The file.
        size: Expected width and height, pixels.

    Raises:
        DataError: If it is missing, unreadable or of another size.
    """
    return torch.from_numpy(_read_image(path, size, ("RGBA",), "RGBA"))


def _read_depth(path: Path, size: tuple[int, int]) -> Tensor:
    millimetres = _read_image(path, size, ("I;16", "I;16B", "I"), None)
    return torch.from_numpy(millimetres.astype(np.float32) / 1000.0)


def _read_image(path: Path, size: tuple[int, int], modes: Sequence[str], convert: str | None) -> np.ndarray:
    try:
        with open_picture(path) as image:
            stored, mode = image.size, image.mode
            if stored == size and (convert or mode in modes):
                return np.array(image.convert(convert) if convert else image)
    except DataError:
        raise
    except FileNotFoundError as err:
        raise DataError(f"{path}: no such file; restore it or capture the character again.") from err
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as err:
        raise DataError(
            f"{path}: can not be read as a picture ({err}); restore it or capture it again."
        ) from err
    if stored != size:
        raise DataError(
            f"{path}: found {stored[0]} x {stored[1]} pixels, expected {size[0]} x {size[1]} as "
            f"{TRANSFORMS_FILE} says; "
            "resize the picture or correct w and h."
        )
    raise DataError(f"{path}: found mode {mode}, expected 16-bit grey depth in mm; capture it again.")


def _write_pictures(folder: Path, pictures: CharacterPictures) -> None:
    image_names = [f"images/{index:03d}.png" for index in range(len(pictures.images))]
    source_files = {name: f"sources/{name}.png" for name in pictures.source_names}
    for sub in ("images", "sources", "poses"):
        (folder / sub).mkdir()
    for name, image in zip(image_names, pictures.images, strict=True):
        Image.fromarray(image).save(folder / name)
    for file, image in zip(source_files.values(), pictures.source_images, strict=True):
        Image.fromarray(image).save(folder / file)
    for index, pose in enumerate(pictures.cameras.world_from_camera.double().numpy()):
        np.savetxt(folder / f"poses/{index:03d}.txt", pose, fmt="%.9g")
    depth_names: list[str] = []
    if pictures.depths is not None:
        (folder / DEPTH_FOLDER).mkdir()
        depth_names = [f"{DEPTH_FOLDER}/{index:03d}.png" for index in range(len(pictures.depths))]
        for name, depth in zip(depth_names, pictures.depths, strict=True):
            Image.fromarray(depth).save(folder / name)
    text = transforms_text(pictures.cameras, image_names, depth_names, pictures.source_cameras, source_files)
    (folder / TRANSFORMS_FILE).write_text(text, encoding="utf-8")


def _source_views(images: Tensor, cameras: Cameras) -> SourceViews:
    """Pictures uint8 (V, H, W, 4) and their cameras (V,) as B = 1."""
    flags = torch.zeros(1, len(images), dtype=torch.bool)
    return SourceViews(
        images=(images.float() / 255.0).permute(0, 3, 1, 2)[None].contiguous(),
        cameras=cameras[None],
        present=~flags,
        mirrored=flags,
    )


def _rank(name: str) -> tuple[int, str]:
    return (SOURCE_ORDER.index(name) if name in SOURCE_ORDER else len(SOURCE_ORDER), name)
