"""Hats, crowns, hoods and headbands."""

from collections.abc import Callable

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.head import Head
from charnerf.procedural.headwear import brim_seat, painted_cloth, turned
from charnerf.procedural.helmets import make_great_helm, make_halo, make_headphones, make_helmet
from charnerf.procedural.parts import Painted, Part, flat
from charnerf.procedural.shapes import (
    UP,
    Array,
    ball,
    lathe,
    loft,
    slab,
)
from charnerf.procedural.textures import (
    darker,
)


def _wizard(figure: Figure, head: Head) -> list[Part]:
    level, brim, tall = figure.between(0.66, 0.8), figure.between(1.4, 2.1), figure.between(0.5, 1.1)
    centre, wide, deep = brim_seat(figure, head, level)
    bend = np.array((figure.between(-0.3, 0.3), figure.between(-0.1, 0.7), 0.0)) * tall * figure.build.head
    steps = np.array((0.0, 0.3, 0.6, 0.85, 1.0))
    path = centre + steps[:, None] * tall * figure.build.head * UP + (steps**2)[:, None] * bend
    radii = np.array((1.02, 0.75, 0.45, 0.2, 0.04))[:, None] * np.array((wide, deep))
    cone = loft(path, radii, axis=UP, sides=10)
    disc = turned(figure, head, level, [(0.9 * brim, -0.06), (brim, -0.03), (1.0, 0.05)])
    band = turned(figure, head, level, [(1.06, 0.04), (1.0, 0.14)])
    color = figure.palette.main if figure.chance(0.6) else figure.palette.second
    return [
        painted_cloth(figure, "hat", cone, color),
        flat("hat", disc, darker(color, 0.85)),
        flat("hat", band, figure.palette.accent),
    ]


def _brimmed(figure: Figure, head: Head) -> list[Part]:
    """Top hats, straw hats, bowlers and the like."""
    level, brim = figure.between(0.68, 0.8), figure.between(1.2, 2.0)
    tall, flare = figure.between(0.2, 0.6), figure.between(0.7, 1.1)
    crown = turned(
        figure,
        head,
        level,
        [(1.0, 0.0), (0.5 + 0.5 * flare, 0.6 * tall), (flare, tall), (0.6 * flare, 1.04 * tall)],
    )
    droop = figure.between(-0.05, 0.06)
    disc = turned(figure, head, level, [(brim, droop - 0.02), (brim, droop + 0.02), (0.9, 0.05)])
    band = turned(figure, head, level, [(1.05, 0.03), (0.5 + 0.53 * flare + 0.02, 0.13)])
    color = figure.palette.leather if figure.chance(0.4) else figure.palette.main
    parts = [
        painted_cloth(figure, "hat", crown, color),
        flat("hat", disc, darker(color, 0.9)),
        flat("hat", band, figure.palette.accent),
    ]
    return parts + (_feather(figure, head) if figure.chance(0.3) else [])


def _feather(figure: Figure, head: Head) -> list[Part]:
    centre, wide, _ = brim_seat(figure, head, 0.8)
    side = 1.0 if figure.chance(0.5) else -1.0
    root = centre + np.array((side * wide, 0.0, 0.0))
    long = figure.build.head * figure.between(0.4, 0.8)
    path = root + long * np.array(((0.0, 0.0, 0.0), (side * 0.15, 0.2, 0.5), (side * 0.1, 0.7, 0.9)))
    return [
        flat(
            "hat",
            loft(
                path,
                long * np.array(((0.03, 0.03), (0.05, 0.14), (0.01, 0.03))),
                front=(0.0, 1.0, -1.0),
                sides=6,
            ),
            figure.palette.accent,
        )
    ]


def _cap(figure: Figure, head: Head) -> list[Part]:
    """A cap with a bill, worn forwards or backwards, or a beanie."""
    level = figure.between(0.66, 0.76)
    color = figure.palette.main if figure.chance(0.5) else figure.palette.accent
    tall = 1.06 - level
    dome = turned(
        figure, head, level, [(1.0, 0.0), (1.02, 0.4 * tall), (0.85, 0.8 * tall), (0.45, 1.08 * tall)]
    )
    parts = [painted_cloth(figure, "hat", dome, color)]
    if figure.chance(0.35):
        parts.append(
            flat("hat", turned(figure, head, level, [(1.08, -0.03), (1.08, 0.09)]), figure.palette.second)
        )
        if figure.chance(0.6):
            top = figure.build.head_centre + 0.6 * figure.build.head * UP
            parts.append(
                flat(
                    "hat", ball(top, 0.24 * figure.build.head_width, sides=8, rings=6), figure.palette.second
                )
            )
        return parts
    centre, wide, deep = brim_seat(figure, head, level)
    ahead = -1.0 if figure.chance(0.8) else 1.0
    reach = figure.between(0.4, 0.9)
    middle = centre + np.array((0.0, ahead * deep * (1.0 + 0.35 * reach), 0.02))
    parts.append(
        flat(
            "hat",
            ball(middle, (0.8 * wide, 0.6 * reach * deep + 0.2 * deep, 0.035 * figure.build.head), rings=4),
            darker(color, 0.7),
        )
    )
    return parts


def _crown(figure: Figure, head: Head) -> list[Part]:
    level = figure.between(0.72, 0.84)
    gold = figure.palette.accent if figure.chance(0.3) else np.array((0.9, 0.72, 0.25))
    centre, wide, deep = brim_seat(figure, head, level)
    parts = [flat("crown", turned(figure, head, level, [(1.03, 0.0), (1.08, 0.12)]), gold)]
    count, tall = int(figure.rng.integers(5, 10)), figure.build.head * figure.between(0.08, 0.25)
    for angle in np.arange(count) * 2.0 * np.pi / count:
        root = centre + np.array((np.sin(angle) * wide, -np.cos(angle) * deep, 0.1 * figure.build.head))
        parts.append(flat("crown", lathe(root, [(0.16 * wide, 0.0), (0.02 * wide, tall)], sides=5), gold))
    jewel = centre + np.array((0.0, -1.08 * deep, 0.06 * figure.build.head))
    parts.append(flat("crown", ball(jewel, 0.1 * wide, sides=6, rings=4), figure.palette.main))
    return parts


def _hood(figure: Figure, head: Head) -> list[Part]:
    """A hood: around the sides and the back, over the forehead, with a point behind."""
    thick, color = (
        figure.between(0.1, 0.2),
        figure.palette.main if figure.chance(0.5) else figure.palette.second,
    )
    levels = np.array((-0.22, 0.0, 0.4, 0.72, 0.76, 0.92, 1.04 + thick))
    sides = 1.0 + thick * np.array((1.6, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)) - np.array((0, 0, 0, 0, 0, 0, 0.5))
    fronts = np.array((0.5, 0.15, 0.1, 0.1, 1.1, 1.15, 0.7)) + figure.between(0.0, 0.15)
    shape = head.shell(
        figure, levels, sides, fronts, 1.0 + thick * np.array((1.6, 1.2, 1.3, 1.6, 1.6, 1.5, 2.0))
    )
    parts = [painted_cloth(figure, "hood", shape, color)]
    if figure.chance(0.5):
        tail = figure.build.head_centre + np.array((0.0, figure.build.head_depth, 0.35 * figure.build.head))
        path = tail + figure.build.head * np.array(((0.0, -0.2, 0.0), (0.0, 0.15, 0.05), (0.0, 0.4, -0.15)))
        parts.append(
            flat(
                "hood",
                loft(path, figure.build.head_width * np.array((0.7, 0.4, 0.04)), front=UP, sides=8),
                color,
            )
        )
    return parts


def _pirate(figure: Figure, head: Head) -> list[Part]:
    """A bicorne: a wide plate across the crown."""
    level = figure.between(0.7, 0.8)
    centre, wide, deep = brim_seat(figure, head, level)
    build, color = figure.build, darker(figure.palette.leather, 0.7)
    angle = np.linspace(0.0, np.pi, 9)
    arc = np.stack((1.45 * wide * np.cos(angle), 0.42 * build.head * np.sin(angle) ** 0.8 - 0.02), axis=-1)
    parts = []
    for ahead in (-1.0, 1.0):
        plate = slab(arc * (1.0 if ahead < 0 else 0.95), 0.16 * deep)
        tilt = np.eye(3)
        tilt[1, 2] = -0.35 * ahead
        parts.append(
            flat("hat", plate.moved(tilt, centre + np.array((0.0, ahead * 1.0 * deep, 0.02))), color)
        )
    parts.append(
        flat("hat", turned(figure, head, level, [(1.03, 0.0), (1.0, 0.18), (0.6, 0.34)]), darker(color, 0.8))
    )
    badge = centre + np.array((0.0, -1.08 * deep + 0.07 * build.head, 0.2 * build.head))
    parts.append(
        flat(
            "hat",
            ball(badge, (0.22 * wide, 0.08 * deep, 0.22 * wide), sides=8, rings=5),
            figure.palette.accent,
        )
    )
    return parts


def _band(figure: Figure, head: Head) -> list[Part]:
    """A headband, with feathers, knot, goggles or a lamp."""
    level = figure.between(0.66, 0.8)
    color = figure.palette.accent
    parts = [flat("headband", turned(figure, head, level, [(0.99, 0.0), (1.0, 0.1)]), color)]
    kind = figure.choose("knot", "goggles", "feathers", "plain")
    if kind == "plain":
        return parts
    add = {"knot": _knot, "goggles": _goggles, "feathers": _feathers}[kind]
    return parts + [
        flat("headband", shape, paint) for shape, paint in add(figure, *brim_seat(figure, head, level))
    ]


def _knot(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """The ends of a band knotted behind the head."""
    build = figure.build
    painted: Painted = []
    for lean in (-0.3, 0.4):
        root = centre + np.array((0.0, deep, 0.05 * build.head))
        path = np.stack(
            (
                root,
                root + build.head * np.array((lean * 0.5, 0.2, -0.15)),
                root + build.head * np.array((lean, 0.3, -0.5)),
            )
        )
        radii = build.head_width * np.array(((0.08, 0.05), (0.12, 0.04), (0.14, 0.03)))
        painted.append((loft(path, radii, sides=4), figure.palette.accent))
    return painted


def _goggles(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """Two glasses in metal."""
    painted: Painted = []
    for side in (-1.0, 1.0):
        path = (
            centre
            + np.array((side * 0.42 * wide, 0.0, 0.06 * figure.build.head))
            + np.outer((0.85, 1.12), (0.0, -deep, 0.0))
        )
        glass = ball(path[1], (0.22 * wide, 0.04 * wide, 0.22 * wide), rings=4)
        painted += [
            (loft(path, np.full(2, 0.3 * wide), front=UP, sides=10), figure.palette.metal),
            (glass, figure.palette.second),
        ]
    return painted


def _feathers(figure: Figure, centre: Array, wide: float, deep: float) -> Painted:
    """One to five feathers, before or behind."""
    head = figure.build.head
    painted: Painted = []
    for lean in np.linspace(-0.5, 0.5, int(figure.rng.integers(1, 6))):
        root = centre + np.array((lean * wide, (0.9 if figure.chance(0.5) else -0.9) * deep, 0.03))
        path = root + head * np.array(((0.0, 0.0, 0.0), (0.4 * lean, 0.0, 0.28), (0.8 * lean, 0.05, 0.55)))
        radii = head * np.array(((0.03, 0.02), (0.07, 0.02), (0.01, 0.01)))
        painted.append((loft(path, radii, sides=5), figure.palette.second))
    return painted


HATS: tuple[tuple[Callable[[Figure, Head], list[Part]], float], ...] = (
    (_wizard, 0.14),
    (_brimmed, 0.15),
    (_cap, 0.16),
    (make_helmet, 0.17),
    (make_great_helm, 0.09),
    (_crown, 0.07),
    (_hood, 0.10),
    (_pirate, 0.06),
    (_band, 0.12),
    (make_headphones, 0.04),
    (make_halo, 0.02),
)


COVERING = (_wizard, _brimmed, _cap, make_helmet, make_great_helm, _hood, _pirate)


def make_hat(figure: Figure, head: Head) -> tuple[list[Part], bool]:
    """Something on the head, and whether it hides the top of the hair."""
    weights = np.array([weight for _, weight in HATS])
    make, _ = HATS[int(figure.rng.choice(len(HATS), p=weights / weights.sum()))]
    return make(figure, head), make in COVERING
