"""A data set on a command line: ours, or another program's with what is said of its views."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.options import Dataset
from charnerf.errors import ConfigError

if TYPE_CHECKING:
    from charnerf.foreign.reading import Reading

SIZE = 128
Front = Annotated[
    int | None,
    typer.Option(
        "--front",
        metavar="N",
        min=0,
        help="Of a foreign data set: number of the front view; by azimuth if left out.",
    ),
]
Side = Annotated[
    int | None,
    typer.Option("--side", metavar="N", min=0, help="The same of the view from the character's left."),
]
Back = Annotated[
    int | None, typer.Option("--back", metavar="N", min=0, help="The same of the view from behind.")
]
KeepFrame = Annotated[
    bool,
    typer.Option(
        "--keep-frame",
        help="Take its poses as they are; else characters are brought to 2 m, feet on the floor.",
    ),
]
Pixels = Annotated[
    int | None,
    typer.Option("--pixels", metavar="N", min=8, max=4096, help=f"Side of its pictures; {SIZE} if left out."),
]


@dataclass(frozen=True)
class GivenDataset:
    """A data set's folder, and how it is read where it is foreign; None where nothing was said of that."""

    folder: Path
    reading: "Reading | None"

    def opened(self) -> Path:
        """A folder of ours: the given one, or the kept copy of a foreign one, read where that is new.

        Raises:
            ConfigError: If something is said of views that a data set of ours says itself.
            DataError: If it can not be read.
        """
        from charnerf.data.shards import CACHE_MIB, INDEX_FILE, open_cache
        from charnerf.files import cache_folder
        from charnerf.foreign.kept import is_ours, kept_copy
        from charnerf.foreign.reading import Reading

        is_packed = (self.folder / INDEX_FILE).is_file()
        if not is_ours(self.folder) and not is_packed:
            return kept_copy(self.folder, self.reading or Reading(size=SIZE))
        if self.reading is not None:
            raise ConfigError(
                f"--front, --side, --back, --keep-frame, --pixels: {self.folder} is a data set of charnerf, which says its own"
                " views, expected them with foreign ones alone. Leave them out."
            )
        return open_cache(str(self.folder), cache_folder(), CACHE_MIB) if is_packed else self.folder


def dataset_options(
    data: Dataset,
    *,
    front: Front = None,
    side: Side = None,
    back: Back = None,
    keep_frame: KeepFrame = False,
    pixels: Pixels = None,
) -> GivenDataset:
    """The data set of a command line; nothing is read yet."""
    if (front, side, back, pixels) == (None, None, None, None) and not keep_frame:
        return GivenDataset(data, None)
    from charnerf.foreign.reading import Reading

    return GivenDataset(
        data, Reading(front=front, side=side, back=back, keep_frame=keep_frame, size=pixels or SIZE)
    )
