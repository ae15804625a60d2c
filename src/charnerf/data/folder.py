"""A data set on disk, as `data=folder` names it."""

from pathlib import Path
from typing import final

from charnerf.data.base import AbstractData
from charnerf.data.characters import DEPTH_FOLDER
from charnerf.data.layout import DATASET_FILE, read_dataset
from charnerf.data.transforms import read_transforms
from charnerf.errors import ConfigError, DataError


@final
class FolderData(AbstractData):
    """A data set that is there already: captured, generated or from elsewhere.

    Args:
        root: Its folder, with dataset.json.
    """

    def __init__(self, *, root: str) -> None:
        self.root = Path(root)

    def check_image_size(self, size: int) -> None:
        """Check the first character's drawings."""
        if not (self.root / DATASET_FILE).is_file():
            raise ConfigError(
                f"data.root: found no {DATASET_FILE} in '{self.root}', expected a data set; `charnerf capture` "
                "or `charnerf generate` makes one, and data=foreign reads those of nerfstudio and others."
            )
        names = [name for split in read_dataset(self.root).splits.values() for name in split]
        if not names:
            raise ConfigError(f"data.root: found no characters in '{self.root}', expected at least one.")
        cameras = read_transforms(self.root / names[0]).source_cameras
        needed = max(cameras.width, cameras.height)
        if needed != size:
            raise ConfigError(
                f"scale.image_size: found {size}, expected {needed}, the size of the drawings of {self.root} ({names[0]}: "
                f"{cameras.width} x {cameras.height} pixels). Set scale.image_size={needed}, or capture a data set of this size by "
                f"`charnerf capture MESHES -o DATASET --split train --size {size}`."
            )

    def split_sizes(self) -> dict[str, int]:
        """As dataset.json lists them."""
        return {split: len(names) for split, names in read_dataset(self.root).splits.items()}

    def prepare(self, *, depth: bool = False) -> Path:
        """Check that it is a data set and return its folder.

        Args:
            depth: Whether a loss reads captured depth; each training character is asked for its own when it is opened.

        Raises:
            DataError: If dataset.json is missing or wrong, or no character has depth pictures though a loss reads them.
        """
        info = read_dataset(self.root)
        names = [name for split in info.splits.values() for name in split]
        if depth and not any((self.root / name / DEPTH_FOLDER).is_dir() for name in names):
            raise DataError(
                f"{self.root}: no character has depth pictures, expected them because a term of the loss reads depth;"
                " capture the characters again by `charnerf capture --depth`, or set its weight to 0."
            )
        return self.root
