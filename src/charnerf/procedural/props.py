"""Things held: weapons, staffs, shields, books."""

from collections.abc import Callable

import numpy as np

from charnerf.procedural.body import hand_frame
from charnerf.procedural.figure import Figure
from charnerf.procedural.palette import WHITE
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import (
    FRONT,
    UP,
    ball,
    box,
    lathe,
    slab,
    tube,
    unit,
)
from charnerf.procedural.textures import (
    NUM_EMBLEMS,
    Canvas,
    add_emblem,
    add_pattern,
    darker,
)


def _upright(figure: Figure, left: bool, parts: list[Part], lean_deg: float) -> list[Part]:
    """Put a prop, made upright about its grip at the origin, into a hand."""
    _, along, middle = hand_frame(figure, left)
    forward = np.deg2rad(lean_deg)
    # Level arms hold props upright; hanging arms hold them pointing forwards and up.
    level = 1.0 - abs(along[2])
    up = unit(
        level * np.array((0.0, -np.sin(forward), np.cos(forward)))
        + (1.0 - level) * np.array((0.0, -0.8, 0.6))
    )
    side = unit(np.cross(up, (0.0, 1.0, 0.001)))
    ahead = np.cross(side, up)
    turn = np.stack(
        (side, -ahead if np.linalg.det(np.stack((side, -ahead, up))) > 0.0 else ahead, up), axis=-1
    )
    return [Part(part.name, part.shape.moved(turn, middle), part.texels) for part in parts]


def _sword(figure: Figure) -> list[Part]:
    long, wide = figure.between(0.5, 0.95), figure.between(0.03, 0.08)
    metal, palette = figure.palette.metal, figure.palette
    blade = slab(
        ((-wide, 0.12), (wide, 0.12), (0.8 * wide, 0.85 * long), (0.0, long), (-0.8 * wide, 0.85 * long)),
        0.025,
    )
    grip = tube(((0.0, 0.0, -0.1), (0.0, 0.0, 0.12)), (0.022, 0.022), sides=6)
    guard = box((0.0, 0.0, 0.11), (figure.between(0.07, 0.16), 0.025, 0.02))
    return [
        flat("prop", blade, metal),
        flat("prop", grip, palette.leather),
        flat("prop", guard, palette.accent),
    ]


def _staff(figure: Figure) -> list[Part]:
    low, high = figure.between(-0.9, -0.5), figure.between(0.4, 0.8)
    parts = [
        flat(
            "prop", tube(((0.0, 0.0, low), (0.0, 0.0, high)), (0.02, 0.026), sides=6), figure.palette.leather
        )
    ]
    top = np.array((0.0, 0.0, high))
    kind = figure.choose("orb", "crook", "crystal", "spear", "trident")
    if kind == "orb":
        parts.append(
            flat(
                "prop",
                ball(top + 0.05 * UP, figure.between(0.05, 0.09), sides=10, rings=7),
                figure.palette.accent,
            )
        )
    elif kind == "crook":
        path = top + np.array(
            ((0.0, 0.0, -0.02), (0.0, 0.0, 0.12), (0.09, 0.0, 0.2), (0.17, 0.0, 0.12), (0.14, 0.0, 0.04))
        )
        parts.append(flat("prop", tube(path, np.full(5, 0.026), sides=6), figure.palette.leather))
    elif kind == "crystal":
        parts.append(
            flat(
                "prop",
                lathe(top, ((0.02, -0.02), (0.07, 0.08), (0.005, 0.22)), sides=5),
                figure.palette.accent,
            )
        )
    else:
        for x in (0.0,) if kind == "spear" else (-0.07, 0.0, 0.07):
            tip = lathe(
                top + np.array((x, 0.0, 0.0)), ((0.03, 0.0), (0.045, 0.04), (0.004, 0.22)), depth=0.5, sides=6
            )
            parts.append(flat("prop", tip, figure.palette.metal))
        parts.append(
            flat("prop", box(top, (0.09 if kind == "trident" else 0.03, 0.025, 0.02)), figure.palette.metal)
        )
    return parts


def _hammer(figure: Figure) -> list[Part]:
    long = figure.between(0.3, 0.6)
    size = figure.between(0.06, 0.14)
    handle = tube(((0.0, 0.0, -0.15), (0.0, 0.0, long)), (0.022, 0.022), sides=6)
    parts = [flat("prop", handle, figure.palette.leather)]
    if figure.chance(0.5):
        parts.append(flat("prop", box((0.0, 0.0, long), (1.6 * size, size, size)), figure.palette.metal))
        parts.append(
            flat(
                "prop",
                box((1.62 * size, 0.0, long), (0.1 * size, 1.1 * size, 1.1 * size)),
                figure.palette.accent,
            )
        )
        return parts
    wide = 2.2 * size
    edge = ((0.0, -0.4 * size), (wide, -size), (1.15 * wide, 0.0), (wide, size), (0.0, 0.4 * size))
    for side in (1.0, -1.0) if figure.chance(0.5) else (1.0,):
        blade = slab(edge, 0.04).moved(np.diag((side, 1.0, 1.0)), (0.0, 0.0, long - 0.05))
        parts.append(flat("prop", blade, figure.palette.metal))
    return parts


def _gun(figure: Figure) -> list[Part]:
    long = figure.between(0.2, 0.6)
    dark = darker(figure.palette.metal, 0.6)
    barrel = box((0.0, -0.4 * long, 0.05), (0.03, 0.6 * long, 0.035))
    grip = box((0.0, 0.02, -0.03), (0.024, 0.035, 0.06))
    return [flat("prop", barrel, dark), flat("prop", grip, figure.palette.leather)]


def _wand(figure: Figure) -> list[Part]:
    """A wand, torch, mug or lollipop: a short stick with something on top."""
    stick = tube(((0.0, 0.0, -0.08), (0.0, 0.0, 0.2)), (0.018, 0.02), sides=6)
    top = np.array((0.0, 0.0, 0.24))
    head = ball(top, figure.between(0.04, 0.1), sides=8, rings=6, power=2.0 if figure.chance(0.6) else 5.0)
    return [flat("prop", stick, figure.palette.leather), flat("prop", head, figure.palette.accent)]


def _book(figure: Figure) -> list[Part]:
    cover = box((0.0, 0.0, 0.0), (0.1, 0.04, 0.13))
    pages = box((0.008, 0.0, 0.0), (0.1, 0.03, 0.122))
    return [flat("prop", cover, figure.palette.accent), flat("prop", pages, WHITE)]


HELD: tuple[tuple[Callable[[Figure], list[Part]], float], ...] = (
    (_sword, 0.3),
    (_staff, 0.25),
    (_hammer, 0.2),
    (_gun, 0.08),
    (_wand, 0.12),
    (_book, 0.05),
)


def make_shield(figure: Figure, left: bool) -> list[Part]:
    """A shield on a forearm, its face to the front or outwards."""
    points = figure.build.arm_points(left)
    _, along, _ = hand_frame(figure, left)
    size = figure.between(0.16, 0.32)
    kind = figure.choose("round", "kite", "tower", "hex")
    angle = np.arange(14) * 2.0 * np.pi / 14.0
    outline = {
        "round": np.stack((np.cos(angle), np.sin(angle)), axis=-1) * size,
        "kite": np.array(
            (
                (0.0, -1.3),
                (0.6, -0.6),
                (0.85, 0.3),
                (0.8, 0.85),
                (0.0, 1.0),
                (-0.8, 0.85),
                (-0.85, 0.3),
                (-0.6, -0.6),
            )
        )
        * size,
        "tower": np.array(((-0.75, -1.2), (0.75, -1.2), (0.75, 1.1), (0.0, 1.25), (-0.75, 1.1))) * size,
        "hex": np.stack((np.cos(angle[::2]), np.sin(angle[::2])), axis=-1) * size,
    }[kind]
    canvas = Canvas(
        2.0 * size, 2.0 * size, figure.palette.main if figure.chance(0.6) else figure.palette.metal
    )
    if figure.chance(0.4):
        add_pattern(canvas, figure.rng, figure.palette.second)
    x, y = canvas.local(0.5, 0.5)
    if kind == "round":
        canvas.paint(np.hypot(x, y) > 0.82 * size, figure.palette.metal)
    if figure.chance(0.7):
        add_emblem(
            canvas, (0.5, 0.5), 0.5 * size, int(figure.rng.integers(NUM_EMBLEMS)), figure.palette.accent
        )
    plate = slab(outline, 0.035)
    side = 1.0 if left else -1.0
    turn = np.eye(3)
    if abs(along[2]) > 0.7:
        turn = np.array(((0.0, -side, 0.0), (side, 0.0, 0.0), (0.0, 0.0, 1.0)))
    outwards = turn @ FRONT
    at = 0.35 * points[1] + 0.65 * points[2] + (1.1 * figure.build.arm_radius + 0.03) * outwards
    boss = ball(at + 0.02 * outwards, 0.22 * size, sides=8, rings=6)
    return [Part("shield", plate.moved(turn, at), canvas.image()), flat("shield", boss, figure.palette.metal)]


def make_held(figure: Figure) -> list[Part]:
    """A prop in one hand, at times a second or a shield in the other."""
    weights = np.array([weight for _, weight in HELD])
    left = figure.chance(0.25)
    make, _ = HELD[int(figure.rng.choice(len(HELD), p=weights / weights.sum()))]
    lean = figure.between(-5.0, 40.0)
    parts = _upright(figure, left, make(figure), lean) if figure.chance(0.8) else []
    if figure.chance(0.4):
        return parts + make_shield(figure, not left)
    return parts
