"""A foreign data set, as `data=foreign` names it."""

from pathlib import Path
from typing import final

from charnerf.data.base import AbstractData
from charnerf.errors import ConfigError, DataError
from charnerf.foreign.base import Found
from charnerf.foreign.kept import is_ours, kept_copy, recognised
from charnerf.foreign.reading import Reading


@final
class ForeignData(AbstractData):
    """A data set of another program, read as it is: see docs/datasets.md for the formats and the rule of frames.

    Args:
        root: Its folder.
        size: Side of the square that pictures are brought to.
        front: Number of the view that is the front; None: by azimuth.
        side: Of the view from the character's left.
        back: Of the view from behind.
        keep_frame: Whether poses stay as they are.
    """

    def __init__(
        self,
        *,
        root: str,
        size: int,
        front: int | None,
        side: int | None,
        back: int | None,
        keep_frame: bool,
    ) -> None:
        self.root = Path(root)
        self.reading = Reading(front=front, side=side, back=back, keep_frame=keep_frame, size=size)

    def check_image_size(self, size: int) -> None:
        """Check the size that pictures are brought to."""
        if self.reading.size != size:
            raise ConfigError(
                f"data.size: found {self.reading.size}, expected scale.image_size = {size}; leave data.size out, or set both."
            )

    def split_sizes(self) -> dict[str, int]:
        """As its folders tell."""
        sizes: dict[str, int] = {}
        for one in self._found():
            sizes[one.split] = sizes.get(one.split, 0) + 1
        return sizes

    def prepare(self, *, depth: bool = False) -> Path:
        """Read what is new; the folder of what was read.

        Args:
            depth: Whether a loss reads captured depth, of which a foreign set has none that is read.

        Raises:
            DataError: If it can not be read, or depth is asked for.
        """
        if depth:
            raise DataError(
                f"{self.root}: depth of foreign data sets is not read, expected a loss without; set its weight to 0."
            )
        return kept_copy(self.root, self.reading)

    def _found(self) -> list[Found]:
        if not self.root.is_dir():
            raise ConfigError(f"data.root: found no folder '{self.root}', expected a data set.")
        if is_ours(self.root):
            raise ConfigError(f"data.root: '{self.root}' is a data set of charnerf; read it by data=folder.")
        return recognised(self.root)[1]
