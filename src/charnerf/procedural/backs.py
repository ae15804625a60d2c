"""What is on a back: packs, quivers, tails, wings, banners."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.palette import WHITE
from charnerf.procedural.parts import Painted, Part, flat
from charnerf.procedural.shapes import (
    UP,
    Array,
    ball,
    box,
    loft,
    sheet,
    slab,
    tube,
)
from charnerf.procedural.textures import (
    NUM_EMBLEMS,
    Canvas,
    add_emblem,
    add_pattern,
    darker,
)


def make_backpack(figure: Figure) -> list[Part]:
    """A pack with straps, a quiver, a tank, or a sword across the back."""
    centre, half = figure.trunk(0.62)
    kind = figure.choose("pack", "pack", "tank", "quiver", "sword", "shell")
    back = centre + np.array((0.0, half[1], 0.0))
    size = figure.build.waist * figure.between(0.55, 0.95)
    make = {"pack": _pack, "tank": _tank, "quiver": _quiver, "sword": _sword_on_back, "shell": _shell}[kind]
    return [flat("backpack", shape, color) for shape, color in make(figure, back, size)]


def _pack(figure: Figure, back: Array, size: float) -> Painted:
    """A pack with a pocket and straps, at times with a roll on top."""
    palette = figure.palette
    color = palette.leather if figure.chance(0.5) else palette.accent
    deep = figure.between(0.07, 0.14)
    pack = ball(
        back + np.array((0.0, 0.8 * deep, 0.0)), (size, deep, 1.15 * size), sides=8, rings=6, power=4.0
    )
    pocket = box(back + np.array((0.0, 1.9 * deep, -0.35 * size)), (0.65 * size, 0.3 * deep, 0.35 * size))
    painted: Painted = [(pack, color), (pocket, darker(color, 0.75))]
    if figure.chance(0.5):
        roll = np.stack(
            (back + np.array((-size, deep, 1.3 * size)), back + np.array((size, deep, 1.3 * size)))
        )
        painted.append((tube(roll, np.full(2, 0.3 * size), front=UP, sides=8), palette.second))
    top, wide = figure.trunk(0.85, 1.12)
    low, narrow = figure.trunk(0.45, 1.12)
    for side in (-1.0, 1.0):
        x = side * 0.5 * wide[0]
        path = np.array(
            (
                (x, top[1] + 0.4 * wide[1], top[2] + 0.05),
                (x, top[1] - 0.9 * wide[1], top[2]),
                (x, low[1] - narrow[1] * 0.95, low[2]),
            )
        )
        strap = loft(path, np.full((3, 2), 0.022), front=(1.0, 0.0, 0.0), sides=4)
        painted.append((strap, darker(palette.leather, 0.7)))
    return painted


def _tank(figure: Figure, back: Array, size: float) -> Painted:
    """Two bottles."""
    painted: Painted = []
    for side in (-0.5, 0.5):
        path = back + np.array(((side * size, 0.06, -0.6 * size), (side * size, 0.06, 0.9 * size)))
        painted.append((tube(path, np.full(2, 0.42 * size), sides=8), figure.palette.metal))
    return painted


def _quiver(figure: Figure, back: Array, size: float) -> Painted:
    """A quiver with three arrows."""
    path = back + np.array(((0.7 * size, 0.06, -0.7 * size), (-0.6 * size, 0.06, 1.1 * size)))
    painted: Painted = [(loft(path, np.array((0.06, 0.08)), sides=8), figure.palette.leather)]
    for shift in (-0.03, 0.0, 0.03):
        arrow = np.stack((path[0] + (shift, 0.0, 0.0), path[1] + np.array((shift - 0.06, 0.0, 0.12))))
        painted.append((loft(arrow, np.full(2, 0.014), sides=4), figure.palette.accent))
    return painted


def _sword_on_back(figure: Figure, back: Array, size: float) -> Painted:
    """A blade across the back, and its grip."""
    path = back + np.array(
        ((size, 0.04, -1.2 * size), (-0.8 * size, 0.04, 1.0 * size), (-1.15 * size, 0.04, 1.45 * size))
    )
    blade = loft(path[:2], np.array(((0.06, 0.02), (0.06, 0.02))), sides=4)
    grip = loft(path[1:], np.full(2, 0.03), sides=6)
    return [(blade, figure.palette.metal), (grip, figure.palette.leather)]


def _shell(figure: Figure, back: Array, size: float) -> Painted:
    """A turtle's shell."""
    shell = ball(back, (1.2 * size, 0.16, 1.4 * size), sides=10, rings=8)
    return [(shell, darker(figure.palette.second, 0.8))]


def make_tail(figure: Figure) -> list[Part]:
    """A tail: thin with a tuft, bushy, or a stub."""
    root, half = figure.trunk(0.08)
    root = root + np.array((0.0, 0.8 * half[1], 0.0))
    kind = figure.choose("thin", "bushy", "stub", "lizard")
    long = figure.between(0.35, 0.7)
    steps = np.linspace(0.0, 1.0, 6)
    sway = figure.between(-0.25, 0.25)
    rise = figure.between(-0.5, 0.7)
    path = root + long * np.stack((sway * steps**2, steps * 0.8, rise * steps**2 - 0.35 * steps), axis=-1)
    path[:, 2] = np.maximum(path[:, 2], 0.07)
    thick = figure.build.waist
    if kind == "stub":
        return [
            flat(
                "tail",
                ball(root + np.array((0.0, 0.05, 0.0)), 0.35 * thick, sides=8, rings=6),
                figure.palette.skin,
            )
        ]
    radii = {
        "thin": np.array((0.16, 0.14, 0.12, 0.1, 0.09, 0.08)),
        "bushy": np.array((0.15, 0.25, 0.4, 0.48, 0.4, 0.12)),
        "lizard": np.array((0.5, 0.4, 0.3, 0.2, 0.12, 0.03)),
    }[kind] * thick
    parts = [flat("tail", tube(path, radii, front=(1.0, 0.0, 0.0), sides=8), figure.palette.skin)]
    if kind == "thin" or figure.chance(0.5):
        tuft = ball(path[-1], max(1.4 * radii[-1], 0.2 * thick), sides=8, rings=6)
        parts.append(flat("tail", tuft, figure.palette.hair if figure.chance(0.5) else WHITE))
    return parts


def _wing_outline(kind: str) -> Array:
    if kind == "bat":
        return np.array(
            (
                (0.0, 0.0),
                (0.25, -0.12),
                (0.4, 0.05),
                (0.62, -0.1),
                (0.75, 0.12),
                (1.0, 0.1),
                (0.85, 0.5),
                (0.4, 0.62),
                (0.0, 0.3),
            )
        )
    if kind == "feather":
        return np.array(
            (
                (0.0, -0.1),
                (0.3, -0.4),
                (0.6, -0.5),
                (0.85, -0.35),
                (1.0, 0.1),
                (0.9, 0.5),
                (0.5, 0.6),
                (0.0, 0.3),
            )
        )
    return np.array(
        (
            (0.0, -0.05),
            (0.4, -0.45),
            (0.75, -0.3),
            (0.7, 0.0),
            (1.0, 0.3),
            (0.85, 0.65),
            (0.45, 0.5),
            (0.0, 0.15),
        )
    )


def make_wings(figure: Figure) -> list[Part]:
    """A pair of bat, bird or insect wings."""
    kind = figure.choose("bat", "feather", "insect")
    centre, half = figure.trunk(0.75)
    size = figure.between(0.4, 0.75)
    color = WHITE if kind == "feather" and figure.chance(0.5) else figure.palette.accent
    canvas = Canvas(size, size, color)
    if figure.chance(0.5):
        add_pattern(canvas, figure.rng, darker(color, 0.75))
    sweep = np.deg2rad(figure.between(10.0, 55.0))
    shape = slab(_wing_outline(kind) * size, 0.02)
    turn = np.array(
        ((np.cos(sweep), -np.sin(sweep), 0.0), (np.sin(sweep), np.cos(sweep), 0.0), (0.0, 0.0, 1.0))
    )
    root = centre + np.array((0.03, 0.9 * half[1], 0.0))
    wing = shape.moved(turn, root)
    return [Part("left_wing", wing, canvas.image()), Part("right_wing", wing.mirrored(), canvas.image())]


def make_flag(figure: Figure) -> list[Part]:
    """A banner on a pole behind."""
    centre, half = figure.trunk(0.6)
    root = centre + np.array((0.0, half[1] + 0.03, 0.0))
    top = np.array((0.0, root[1] + 0.05, 2.3))
    pole = tube(np.stack((root, top)), np.full(2, 0.018), front=(1.0, 0.0, 0.0), sides=6)
    canvas = Canvas(0.4, 0.5, figure.palette.accent)
    add_emblem(canvas, (0.5, 0.5), 0.14, int(figure.rng.integers(NUM_EMBLEMS)), figure.palette.main)
    columns, rows = np.meshgrid(np.linspace(0.0, 0.4, 4), np.linspace(-0.45, 0.0, 3))
    grid = np.stack(
        (columns, np.full_like(columns, top[1]) + 0.03 * np.sin(12.0 * columns), top[2] + rows), axis=-1
    )
    return [flat("flag", pole, figure.palette.leather), Part("flag", sheet(grid, 0.015), canvas.image())]
