"""How things sit on a head."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.head import Head
from charnerf.procedural.parts import Part
from charnerf.procedural.shapes import (
    Array,
    Shape,
    lathe,
)
from charnerf.procedural.textures import (
    Canvas,
    add_pattern,
)


def brim_seat(figure: Figure, head: Head, level: float) -> tuple[Array, float, float]:
    """Centre (3,) of a hat's rim, its half width and half depth, m: wide enough to go round the head."""
    centre, _ = head.ring(figure, level)
    around = [head.ring(figure, other)[1] for other in np.linspace(level, 0.92, 4)]
    half = np.max(around, axis=0)
    return centre, 1.1 * float(half[0]) + 0.01, 1.1 * float(half[1]) + 0.01


def turned(figure: Figure, head: Head, level: float, profile: list[tuple[float, float]]) -> Shape:
    """A lathe around the head: profile of (radius in rims, height in head heights)."""
    centre, wide, deep = brim_seat(figure, head, level)
    line = np.array(profile) * np.array((wide, figure.build.head))
    return lathe(
        centre,
        line,
        depth=deep / wide,
        sides=head.sides if head.sides != 4 else 8,
        power=min(head.power, 4.0),
    )


def painted_cloth(figure: Figure, name: str, shape: Shape, color: Array) -> Part:
    """A shape of cloth, at times with a pattern."""
    canvas = Canvas(2.0 * np.pi * figure.build.head_width, figure.build.head, color)
    if figure.chance(0.4):
        add_pattern(canvas, figure.rng, figure.palette.second)
    canvas.shade(1.0, figure.shade)
    return Part(name, shape, canvas.image())
