"""Embedded characters and shapes without meaning: as many as asked for, of seeds, without any file.

This is the room's whole face: `make_character(seed)` and `make_shape(seed)`, and the versions of what they make.
"""

from charnerf.procedural.assembly import SHAPES_VERSION as SHAPES_VERSION
from charnerf.procedural.assembly import make_shape as make_shape
from charnerf.procedural.character import GENERATOR_VERSION as GENERATOR_VERSION
from charnerf.procedural.character import make_character as make_character
