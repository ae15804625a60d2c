"""A data set on disk, as `data=folder` names it."""

from pathlib import Path
from typing import final

from charnerf.data.layout import read_dataset


@final
class FolderData:
    """A data set that is there already: captured, generated or from elsewhere.

    Args:
        root: Its folder, with dataset.json.
    """

    def __init__(self, *, root: str) -> None:
        self.root = Path(root)

    def prepare(self) -> Path:
        """Check that it is a data set and return its folder.

        Raises:
            DataError: If dataset.json is missing or wrong.
        """
        read_dataset(self.root)
        return self.root
