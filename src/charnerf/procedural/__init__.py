"""Embedded characters: many different humanoids from a seed, without any file.

This is the room's whole face: `make_character(seed)`, and the version of what it makes.
"""

from charnerf.procedural.character import GENERATOR_VERSION as GENERATOR_VERSION
from charnerf.procedural.character import make_character as make_character
