"""Embedded characters and shapes without meaning: as many as asked for, of seeds, without any file.

This is the room's whole face: `make_character(seed)` and `make_shape(seed)`, the versions of what they make, and `make_piece`,
what shapes are assembled of.
"""

from charnerf.procedural.assembly import SHAPES_VERSION as SHAPES_VERSION
from charnerf.procedural.assembly import make_colors as make_colors
from charnerf.procedural.assembly import make_piece as make_piece
from charnerf.procedural.assembly import make_shape as make_shape
from charnerf.procedural.character import GENERATOR_VERSION as GENERATOR_VERSION
from charnerf.procedural.character import make_character as make_character
