"""People of the MakeHuman project's assets (CC0): as many as asked for, of seeds; the assets are the user's to fetch.

This is the room's whole face.
"""

from charnerf.people.assets import Assets as Assets
from charnerf.people.person import PEOPLE_VERSION as PEOPLE_VERSION
from charnerf.people.person import make_person as make_person
