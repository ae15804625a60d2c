"""People of the MakeHuman project's assets, as `data=people` names them."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import final

from charnerf.capture.generated import Generator
from charnerf.capture.generated_data import AbstractGeneratedData
from charnerf.people import PEOPLE_VERSION, Assets, make_person


@final
@dataclass(frozen=True, kw_only=True)
class PeopleData(AbstractGeneratedData):
    """Clothed, armoured and robed people; see charnerf/people.

    Attributes:
        assets: Folder of clones; docs/generators.md says which.
    """

    assets: str

    @property
    def generator(self) -> Generator:
        """Of those assets."""
        return people_generator(Path(self.assets))


def people_generator(folder: Path) -> Generator:
    """The generator of people; other assets make other people.

    Args:
        folder: Of the assets.

    Raises:
        DataError: If what every person needs is not there.
    """
    assets = Assets(folder.expanduser().resolve())
    assets.check()
    return Generator("people", PEOPLE_VERSION, partial(make_person, assets=assets), {"assets": assets.digest})
