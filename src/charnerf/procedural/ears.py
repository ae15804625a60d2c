"""Ears, horns and antennae."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.head import Head
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import (
    UP,
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
    build, parts = figure.build, []
    centre, half = head.ring(figure, 0.45)
    skin = darker(figure.palette.skin, 0.92)
    animal = (
        figure.surface == "fur"
        or (figure.surface == "creature" and figure.chance(0.4))
        or figure.chance(0.04)
    )
    style = (
        figure.choose("bunny", "cat", "bear", "mouse")
        if animal
        else figure.choose("round", "round", "round", "elf")
    )
    if figure.surface == "creature" and not animal and figure.chance(0.5):
        style = "elf"
    long = figure.between(0.6, 1.1)
    for side in (-1.0, 1.0):
        at_side = centre + np.array((side * half[0], 0.05 * half[1], 0.0))
        top, wide = head.ring(figure, 0.88)
        on_top = top + np.array((side * 0.7 * wide[0], 0.0, 0.0))
        if style == "round":
            size = 0.2 * build.head
            parts.append(
                flat("ears", ball(at_side, (0.25 * size, 0.45 * size, 0.6 * size), sides=8, rings=6), skin)
            )
        elif style == "elf":
            path = np.stack((at_side, at_side + build.head_width * long * np.array((side * 0.9, 0.35, 0.35))))
            parts.append(
                flat("ears", loft(path, np.array(((0.16, 0.06), (0.02, 0.01))) * build.head, sides=6), skin)
            )
        elif style in ("bear", "mouse"):
            size = build.head_width * (0.34 if style == "bear" else 0.6)
            parts.append(
                flat(
                    "ears", ball(on_top + 0.4 * size * UP, (size, 0.3 * size, size), sides=10, rings=6), skin
                )
            )
        else:
            tall = build.head * (0.65 * long if style == "bunny" else 0.32)
            wide_ear = build.head_width * (0.2 if style == "bunny" else 0.3)
            lean = np.array((side * 0.15 * tall, 0.1 * tall, 0.0))
            path = np.stack(
                (on_top - 0.1 * tall * UP, on_top + 0.55 * tall * UP + lean, on_top + tall * UP + 1.6 * lean)
            )
            shares = (
                ((1.0, 0.4), (1.0, 0.4), (0.3, 0.1))
                if style == "bunny"
                else ((1.0, 0.5), (0.6, 0.3), (0.06, 0.04))
            )
            parts.append(flat("ears", loft(path, wide_ear * np.array(shares), sides=6), skin))
            inner = path - np.array((0.0, 0.32 * wide_ear, 0.0))
            pink = mix(figure.palette.skin, (0.95, 0.6, 0.65), 0.6)
            parts.append(flat("ears", loft(inner, 0.6 * wide_ear * np.array(shares) + 0.002, sides=6), pink))
    return parts


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
