"""Ears, horns and antennae."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.head import Head
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import (
    UP,
    Array,
    Shape,
    ball,
    loft,
    tube,
)
from charnerf.procedural.textures import (
    darker,
    mix,
)


def make_ears(figure: Figure, head: Head) -> list[Part]:
    """Human, pointed or animal ears."""
    centre, half = head.ring(figure, 0.45)
    top, wide = head.ring(figure, 0.88)
    style = _style(figure)
    long = figure.between(0.6, 1.1)
    parts = []
    for side in (-1.0, 1.0):
        at_side = centre + np.array((side * half[0], 0.05 * half[1], 0.0))
        on_top = top + np.array((side * 0.7 * wide[0], 0.0, 0.0))
        if style in ("bunny", "cat"):
            parts += _long_ear(figure, on_top, side, long if style == "bunny" else None)
        else:
            shape = _short_ear(figure, style, side, at_side, on_top, long)
            parts.append(flat("ears", shape, darker(figure.palette.skin, 0.92)))
    return parts


def _style(figure: Figure) -> str:
    """Animals' ears for fur, some creatures and few others; round or pointed ones else."""
    animal = (
        figure.surface == "fur"
        or (figure.surface == "creature" and figure.chance(0.4))
        or figure.chance(0.04)
    )
    if animal:
        return figure.choose("bunny", "cat", "bear", "mouse")
    style = figure.choose("round", "round", "round", "elf")
    return "elf" if figure.surface == "creature" and figure.chance(0.5) else style


def _short_ear(figure: Figure, style: str, side: float, at_side: Array, on_top: Array, long: float) -> Shape:
    """A round or pointed ear beside the head, or a bear's or mouse's on top."""
    build = figure.build
    if style == "round":
        size = 0.2 * build.head
        return ball(at_side, (0.25 * size, 0.45 * size, 0.6 * size), sides=8, rings=6)
    if style == "elf":
        path = np.stack((at_side, at_side + build.head_width * long * np.array((side * 0.9, 0.35, 0.35))))
        return loft(path, np.array(((0.16, 0.06), (0.02, 0.01))) * build.head, sides=6)
    size = build.head_width * (0.34 if style == "bear" else 0.6)
    return ball(on_top + 0.4 * size * UP, (size, 0.3 * size, size), sides=10, rings=6)


def _long_ear(figure: Figure, on_top: Array, side: float, long: float | None) -> list[Part]:
    """A bunny's ear of a length, or a cat's, and its inside."""
    build, skin = figure.build, figure.palette.skin
    tall = build.head * (0.32 if long is None else 0.65 * long)
    wide = build.head_width * (0.3 if long is None else 0.2)
    lean = np.array((side * 0.15 * tall, 0.1 * tall, 0.0))
    path = np.stack(
        (on_top - 0.1 * tall * UP, on_top + 0.55 * tall * UP + lean, on_top + tall * UP + 1.6 * lean)
    )
    half_sizes = np.array(
        ((1.0, 0.5), (0.6, 0.3), (0.06, 0.04)) if long is None else ((1.0, 0.4), (1.0, 0.4), (0.3, 0.1))
    )
    inner = path - np.array((0.0, 0.32 * wide, 0.0))
    pink = mix(skin, (0.95, 0.6, 0.65), 0.6)
    return [
        flat("ears", loft(path, wide * half_sizes, sides=6), darker(skin, 0.92)),
        flat("ears", loft(inner, 0.6 * wide * half_sizes + 0.002, sides=6), pink),
    ]


def make_horns(figure: Figure, head: Head) -> list[Part]:
    """Two curved horns, or antennae on robots."""
    parts = []
    build = figure.build
    centre, half = head.ring(figure, 0.85)
    long = build.head * figure.between(0.3, 0.7)
    thick = build.head_width * figure.between(0.1, 0.2)
    out, curl = figure.between(0.2, 1.0), figure.between(-0.4, 0.6)
    color = (
        figure.palette.metal
        if figure.surface == "robot"
        else mix(figure.palette.leather, (0.9, 0.85, 0.7), figure.between(0, 1))
    )
    for side in (-1.0, 1.0):
        root = centre + np.array((side * 0.7 * half[0], 0.0, -0.02))
        steps = np.linspace(0.0, 1.0, 5)[:, None]
        bend = np.array((side * out, 0.0, 0.3)) * steps + np.array((-0.3 * side * out, -curl, 0.7)) * steps**2
        if figure.surface == "robot":
            parts.append(
                flat("horns", tube(root + long * 0.6 * steps * UP, np.full(5, 0.4 * thick), sides=6), color)
            )
            parts.append(
                flat(
                    "horns",
                    ball(root + 0.6 * long * UP, 0.6 * thick, sides=8, rings=6),
                    figure.palette.accent,
                )
            )
        else:
            radii = thick * np.array((1.0, 0.85, 0.65, 0.42, 0.1))
            parts.append(flat("horns", loft(root + long * bend, radii, sides=7), color))
    return parts
