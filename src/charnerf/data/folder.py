"""A data set on disk, as `data=folder` names it."""

from pathlib import Path
from typing import final

from charnerf.data.characters import DEPTH_FOLDER
from charnerf.data.layout import read_dataset
from charnerf.errors import DataError


@final
class FolderData:
    """A data set that is there already: captured, generated or from elsewhere.

    Args:
        root: Its folder, with dataset.json.
    """

    def __init__(self, *, root: str) -> None:
        self.root = Path(root)

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
