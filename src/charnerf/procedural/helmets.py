"""Helmets, headphones and halos."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.head import Head
from charnerf.procedural.headwear import brim_seat, turned
from charnerf.procedural.parts import Painted, Part, flat
from charnerf.procedural.shapes import (
    UP,
    Array,
    box,
    lathe,
    loft,
    tube,
)
from charnerf.procedural.textures import (
    Canvas,
    darker,
)


def make_helmet(figure: Figure, head: Head) -> list[Part]:
    """A metal dome, open or with cheek guards, with horns, a crest or a spike."""
    level, metal = figure.between(0.5, 0.72), figure.palette.metal
    tall = 1.08 - level
    dome = turned(
        figure, head, level, [(1.04, 0.0), (1.05, 0.35 * tall), (0.9, 0.75 * tall), (0.4, 1.05 * tall)]
    )
    rim = turned(figure, head, level, [(1.1, -0.03), (1.1, 0.07)])
    seat = brim_seat(figure, head, level)
    painted: Painted = [(dome, metal), (rim, darker(metal, 0.7)), *_guards(figure, *seat)]
    kind = figure.choose("crest", "spike", "horns", "plain", "horns")
    if kind != "plain":
        painted += {"crest": _crest, "spike": _spike, "horns": _horns}[kind](figure, *seat)
    return [flat("helmet", shape, color) for shape, color in painted]


def _guards(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """A guard of the nose and of the cheeks, if there are any."""
    head, metal = figure.build.head, figure.palette.metal
    painted: Painted = []
    if figure.chance(0.4):
        guard = box((0.0, 0.0, 0.0), (0.1 * wide, 0.06 * deep, 0.2 * head))
        before = centre + np.array((0.0, -1.0 * deep, -0.12 * head))
        painted.append((guard.moved(np.eye(3), before), darker(metal, 0.8)))
    if figure.chance(0.5):
        for side in (-1.0, 1.0):
            beside = centre + np.array((side * 0.98 * wide, -0.15 * deep, -0.2 * head))
            painted.append((box(beside, (0.06 * wide, 0.4 * deep, 0.2 * head)), metal))
    return painted


def _crest(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """A crest from front to back."""
    build = figure.build
    angle = np.deg2rad(np.linspace(-70.0, 100.0, 8))
    arc = np.stack((np.zeros(8), deep * np.sin(angle), 0.5 * build.head * np.cos(angle)), axis=-1) * 1.1
    radii = np.stack((np.full(8, 0.1 * wide), np.full(8, build.head * figure.between(0.1, 0.18))), axis=-1)
    return [(loft(build.head_centre + arc, radii, front=(0.0, -0.4, 1.0), sides=4), figure.palette.accent)]


def _spike(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """A spike on top."""
    build = figure.build
    top = build.head_centre + 0.54 * build.head * UP
    profile = [(0.12 * wide, -0.03), (0.1 * wide, 0.05), (0.01, 0.3 * build.head)]
    return [(lathe(top, profile, sides=6), darker(figure.palette.metal, 1.1))]


def _horns(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """Two horns that bend upwards."""
    build = figure.build
    painted: Painted = []
    for side in (-1.0, 1.0):
        root = centre + np.array((side * 0.9 * wide, 0.0, 0.2 * build.head))
        path = root + build.head * np.array(
            ((0.0, 0.0, 0.0), (side * 0.28, 0.0, 0.06), (side * 0.38, -0.05, 0.3))
        )
        horn = loft(path, build.head_width * np.array((0.22, 0.16, 0.02)), sides=7)
        painted.append((horn, (0.9, 0.87, 0.76)))
    return painted


def make_great_helm(figure: Figure, head: Head) -> list[Part]:
    """A helmet over the whole head with slits, or a space helmet with a visor."""
    build, metal = figure.build, figure.palette.metal
    canvas = Canvas(head.face_width_m, build.head, metal)
    dark = np.array((0.07, 0.07, 0.09))
    if figure.chance(0.5):
        canvas.band(0.0, 0.1, figure.palette.accent)
        canvas.rectangle(0.5, 0.55, 0.85 * build.head_width, 0.09 * build.head_width, dark)
        canvas.strip(0.5, 0.012, dark if figure.chance(0.5) else figure.palette.accent, low=0.1, high=0.9)
        for side in (-1.0, 1.0):
            for row in (0.2, 0.28, 0.36):
                canvas.ellipse(0.5 + 0.07 * side, row, 0.06 * build.head_width, 0.06 * build.head_width, dark)
    else:
        canvas.rgb[:] = figure.palette.main if figure.chance(0.5) else (0.92, 0.92, 0.93)
        canvas.ellipse(
            0.5,
            0.5,
            0.85 * build.head_width,
            0.3 * build.head,
            figure.palette.accent if figure.chance(0.5) else dark,
        )
        canvas.ellipse(0.44, 0.6, 0.16 * build.head_width, 0.06 * build.head, (0.95, 0.95, 0.98))
    levels = np.array((-0.04, 0.0, 0.3, 0.6, 0.85, 0.98, 1.06))
    size = np.array((1.1, 1.12, 1.12, 1.12, 1.12, 1.12, 0.7))
    shape = head.shell(figure, levels, size, size, size, floor=0.35)
    parts = [Part("helmet", shape, canvas.image())]
    if figure.chance(0.35):
        parts += _plume(figure)
    return parts


def _plume(figure: Figure) -> list[Part]:
    build = figure.build
    top = build.head_centre + 0.53 * build.head * UP
    path = top + build.head * np.array(
        ((0.0, 0.0, -0.03), (0.0, 0.08, 0.2), (0.0, 0.4, 0.25), (0.0, 0.62, -0.02))
    )
    return [
        flat(
            "helmet",
            tube(path, build.head_width * np.array((0.12, 0.24, 0.26, 0.1)), front=(1.0, 0.0, 0.0)),
            figure.palette.accent,
        )
    ]


def make_headphones(figure: Figure, head: Head) -> list[Part]:
    """A bow over the head with two cups."""
    build = figure.build
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    arc = np.stack(
        (np.sin(angle) * 1.12 * build.head_width, np.zeros(9), 0.56 * build.head * np.cos(angle)), axis=-1
    )
    parts = [
        flat(
            "headphones",
            loft(build.head_centre + arc, np.full(9, 0.08 * build.head_width), sides=6),
            figure.palette.metal,
        )
    ]
    for side in (-1.0, 1.0):
        path = build.head_centre + np.outer((0.92, 1.2), (side * build.head_width, 0.0, 0.0))
        parts.append(
            flat("headphones", loft(path, np.full(2, 0.16 * build.head), sides=10), figure.palette.accent)
        )
    return parts


def make_halo(figure: Figure, head: Head) -> list[Part]:
    """A disc over the head on a thin stem."""
    build = figure.build
    top = build.head_centre + 0.62 * build.head * UP
    ring = lathe(top, [(0.9 * build.head_width, 0.0), (0.95 * build.head_width, 0.04 * build.head)], sides=14)
    stem = tube(np.stack((build.head_centre, top)), np.full(2, 0.03 * build.head_width), sides=5)
    return [flat("halo", ring, (0.95, 0.85, 0.4)), flat("halo", stem, (0.95, 0.85, 0.4))]
