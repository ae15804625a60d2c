"""Hair and beards."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from charnerf.procedural.figure import Figure
from charnerf.procedural.head import Head
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import UP, Shape, ball, box, loft, rotation, tube, unit
from charnerf.procedural.textures import Canvas, darker, mix

SLANTED = np.array((0.6, -0.5, 0.62))  # locks run in every plane of the body, never along this


@dataclass(frozen=True)
class Hair:
    """Hair parts, and the level of the painted hairline on the head (None: bald)."""

    parts: list[Part]
    hairline: float | None


def _strands(figure: Figure, shape: Shape, name: str = "hair") -> Part:
    """A shape painted with upright strands of hair."""
    color = figure.palette.hair
    canvas = Canvas(2.0 * np.pi * figure.build.head_width, figure.build.head, color)
    count = int(figure.rng.integers(8, 22))
    if figure.chance(0.5):
        canvas.paint((canvas.u * count) % 1.0 < 0.35, darker(color, figure.between(0.75, 0.92)))
    if figure.chance(0.15):
        canvas.band(0.0, figure.between(0.15, 0.4), mix(color, figure.palette.accent, 0.7))
    canvas.shade(1.05, figure.shade)
    return Part(name, shape, canvas.image())


def _cap(
    figure: Figure, head: Head, *, bottom: float, hairline: float, thick: float, low_front: float = -0.1
) -> Part:
    """A shell over the crown: down to bottom behind and at the sides, to the hairline in front."""
    levels = np.array(
        (bottom, 0.5 * (bottom + hairline), hairline - 0.03, hairline + 0.02, 0.87, 0.95, 1.0 + 0.4 * thick)
    )
    fronts = np.array((low_front, low_front, low_front, 1.0 + thick, 1.0 + thick, 1.0 + thick, 0.9))
    backs = np.array((1.0, 1.0 + 0.9 * thick, 1.0 + thick, 1.0 + thick, 1.0 + thick, 1.0 + thick, 0.9))
    sides = np.array((1.02, 1.0 + thick, 1.0 + thick, 1.0 + thick, 1.0 + thick, 1.0 + thick, 0.75))
    return _strands(figure, head.shell(figure, levels, sides, fronts, backs))


def _fringe(figure: Figure, head: Head, hairline: float) -> list[Part]:
    """Hair over the forehead: one lock to a side, or several teeth."""
    build = figure.build
    centre, half = head.ring(figure, hairline)
    color = darker(figure.palette.hair, figure.between(0.88, 1.0))
    if figure.chance(0.5):
        lean = figure.between(-25.0, 25.0)
        lock = ball((0.0, 0.0, 0.0), (0.86 * half[0], 0.22 * half[1], 0.13 * build.head), sides=8, rings=5)
        lock = lock.moved(rotation((0.0, 1.0, 0.0), lean), centre - np.array((0.0, 0.88 * half[1], 0.0)))
        return [flat("hair", lock, color)]
    parts = []
    for offset in np.linspace(-0.7, 0.7, int(figure.rng.integers(3, 6))):
        root = centre + np.array(
            (offset * half[0], -np.sqrt(1.0 - 0.7 * offset**2) * half[1], 0.06 * build.head)
        )
        tip = (
            root
            - build.head * figure.between(0.12, 0.22) * UP
            + np.array((figure.between(-0.1, 0.1) * half[0], -0.02, 0.0))
        )
        radii = half[0] * np.array(((0.24, 0.12), (0.04, 0.03)))
        parts.append(flat("hair", loft(np.stack((root, tip)), radii, sides=6), color))
    return parts


def _lock(figure: Figure, path: ArrayLike, radii: ArrayLike) -> Part:
    shape = tube(path, radii, front=SLANTED, sides=7)
    return flat("hair", shape, darker(figure.palette.hair, figure.between(0.85, 1.0)))


def _short(figure: Figure, head: Head) -> Hair:
    line = figure.between(0.7, 0.82)
    parts = [
        _cap(figure, head, bottom=figure.between(0.3, 0.55), hairline=line, thick=figure.between(0.05, 0.16))
    ]
    if figure.chance(0.5):
        parts += _fringe(figure, head, line)
    return Hair(parts, line)


def _bob(figure: Figure, head: Head) -> Hair:
    line, thick = figure.between(0.66, 0.78), figure.between(0.1, 0.22)
    parts = [
        _cap(
            figure,
            head,
            bottom=figure.between(-0.08, 0.2),
            hairline=line,
            thick=thick,
            low_front=figure.between(-0.1, 0.45),
        )
    ]
    if figure.chance(0.7):
        parts += _fringe(figure, head, line)
    return Hair(parts, line)


def _long(figure: Figure, head: Head) -> Hair:
    line, thick = figure.between(0.68, 0.8), figure.between(0.08, 0.2)
    length = figure.between(0.2, 0.9) if figure.build.name in ("chibi", "blob") else figure.between(0.4, 2.2)
    parts = [_cap(figure, head, bottom=0.15, hairline=line, thick=thick, low_front=figure.between(-0.2, 0.3))]
    levels = np.array((-length, -0.6 * length, 0.0, 0.4))
    sides = np.array((0.7, 0.95, 1.1, 1.02)) * figure.between(0.85, 1.1)
    parts.append(_strands(figure, head.shell(figure, levels, sides, -0.45, np.array((0.9, 1.1, 1.2, 1.0)))))
    if figure.chance(0.6):
        parts += _fringe(figure, head, line)
    return Hair(parts, line)


def _spiky(figure: Figure, head: Head) -> Hair:
    line = figure.between(0.7, 0.8)
    parts = [_cap(figure, head, bottom=0.4, hairline=line, thick=0.08)]
    build = figure.build
    centre = build.head_centre + 0.2 * build.head * UP
    size = np.array((build.head_width, build.head_depth, 0.33 * build.head))
    long, sweep = figure.between(0.2, 0.5), figure.between(0.0, 0.8)
    for _ in range(int(figure.rng.integers(9, 20))):
        azimuth, height = figure.between(0.0, 2.0 * np.pi), figure.between(0.15, 1.0)
        flatness = np.sqrt(1.0 - height**2)
        out = np.array((flatness * np.sin(azimuth), flatness * np.cos(azimuth), height))
        if out[1] < -0.4 and height < 0.5:
            continue
        root = centre + 0.8 * size * out
        tip = root + build.head * long * unit(out + np.array((0.0, sweep, 0.25)))
        parts.append(_lock(figure, np.stack((root, tip)), np.array((0.3, 0.03)) * build.head_width))
    return Hair(parts, line)


def _tied(figure: Figure, head: Head) -> Hair:
    """Ponytail, pigtails, bun or braids on a tight cap."""
    line = figure.between(0.68, 0.8)
    parts = [
        _cap(figure, head, bottom=figure.between(0.3, 0.45), hairline=line, thick=figure.between(0.05, 0.12))
    ]
    build = figure.build
    thick = build.head_width * figure.between(0.2, 0.38)
    centre, half = head.ring(figure, figure.between(0.6, 0.85))
    style = figure.choose("pony", "pigtails", "bun", "buns")
    sides = (0.0,) if style in ("pony", "bun") else (-1.0, 1.0)
    drop = build.head * figure.between(0.4, 1.4) * (0.6 if build.name == "chibi" else 1.0)
    for side in sides:
        root = centre + np.array((side * half[0], (0.3 if side else 0.95) * half[1], 0.0))
        if style in ("bun", "buns"):
            at = root + np.array((side * 0.4, 0.5 * (side == 0.0), 0.7)) * thick
            parts.append(
                flat("hair", ball(at, 1.25 * thick, sides=8, rings=6), darker(figure.palette.hair, 0.9))
            )
            continue
        away = np.array((side, 0.3 if side else 1.0, 0.0))
        path = np.stack(
            (
                root,
                root + 1.6 * thick * away,
                root + 2.0 * thick * away - 0.5 * drop * UP,
                root + 1.6 * thick * away - drop * UP,
            )
        )
        parts.append(_lock(figure, path, np.array((0.6, 1.0, 0.95, 0.35)) * thick))
        parts.append(
            flat(
                "hair", ball(root + 0.5 * thick * away, 0.62 * thick, sides=8, rings=6), figure.palette.accent
            )
        )
    if figure.chance(0.5):
        parts += _fringe(figure, head, line)
    return Hair(parts, line)


def _mohawk(figure: Figure, head: Head) -> Hair:
    build = figure.build
    tall, wide = build.head * figure.between(0.15, 0.4), build.head_width * figure.between(0.14, 0.3)
    parts = []
    for angle in np.linspace(-60.0, 110.0, 7):
        out = np.array((0.0, np.sin(np.deg2rad(angle)), np.cos(np.deg2rad(angle))))
        middle = build.head_centre + out * np.array((0.0, build.head_depth, 0.5 * build.head)) * 0.9
        half = build.head * np.array((0.16, 0.05))
        path = np.stack((middle - 0.05 * out, middle + tall * out))
        blade = loft(
            path,
            np.stack((half[[1, 0]], 0.7 * half[[1, 0]])) + np.array((wide * 0.3, 0.0)),
            front=(1.0, 0.0, 0.0),
            sides=4,
        )
        parts.append(flat("hair", blade, figure.palette.hair))
    return Hair(parts, 0.93 if figure.chance(0.5) else None)


def _afro(figure: Figure, head: Head) -> Hair:
    build, grow = figure.build, figure.between(1.2, 1.6)
    centre = build.head_centre + np.array((0.0, 0.5 * build.head_depth, 0.25 * build.head))
    size = grow * np.array((build.head_width, build.head_depth, 0.42 * build.head))
    line = 0.76
    parts = [_cap(figure, head, bottom=0.4, hairline=line, thick=0.12)]
    if figure.chance(0.5):
        parts.append(flat("hair", ball(centre, size, sides=10, rings=8), figure.palette.hair))
        return Hair(parts, line)
    for _ in range(26):
        out = unit(figure.rng.normal(size=3))
        if out[1] < 0.0 and out[2] < 0.25:
            continue
        shade = darker(figure.palette.hair, figure.between(0.85, 1.0))
        parts.append(
            flat("hair", ball(centre + 0.75 * size * out, 0.3 * build.head_width, sides=7, rings=5), shade)
        )
    return Hair(parts, line)


def _block(figure: Figure, head: Head) -> Hair:
    """A flat top or a box of hair with straight edges."""
    build, line = figure.build, figure.between(0.72, 0.85)
    tall = build.head * figure.between(0.08, 0.3)
    top = build.head_centre + (0.5 * build.head - 0.05 * build.head + tall * 0.5) * UP
    lid = box(
        top,
        (1.06 * build.head_width, 1.06 * build.head_depth, 0.5 * tall + 0.05 * build.head),
        taper=figure.between(0.8, 1.05),
    )
    back = build.head_centre + np.array((0.0, 0.62 * build.head_depth, 0.12 * build.head))
    parts = [flat("hair", lid, figure.palette.hair)]
    low = figure.between(0.2, 0.7)
    half = (1.05 * build.head_width, 0.45 * build.head_depth, 0.5 * low * build.head)
    parts.append(
        flat(
            "hair", box(back + (0.38 - 0.5 * low) * build.head * UP, half), darker(figure.palette.hair, 0.92)
        )
    )
    return Hair(parts, line)


def _locks(figure: Figure, head: Head) -> Hair:
    """Many hanging locks behind and at the sides."""
    build, line = figure.build, figure.between(0.7, 0.8)
    parts = [_cap(figure, head, bottom=0.4, hairline=line, thick=0.1)]
    drop = build.head * figure.between(0.4, 0.9)
    for azimuth in np.linspace(-115.0, 115.0, int(figure.rng.integers(7, 12))):
        out = np.array((np.sin(np.deg2rad(azimuth)), np.cos(np.deg2rad(azimuth)), 0.0))
        root = (
            build.head_centre
            + 0.95 * out * np.array((build.head_width, build.head_depth, 0.0))
            + 0.15 * build.head * UP
        )
        bend = root - 0.5 * drop * UP + 0.12 * build.head * out
        path = np.stack((root, bend, root - drop * figure.between(0.8, 1.1) * UP + 0.1 * build.head * out))
        parts.append(_lock(figure, path, np.array((0.17, 0.17, 0.08)) * build.head_width))
    return Hair(parts, line)


def _bald(figure: Figure, head: Head) -> Hair:
    if figure.chance(0.5):
        return Hair([], None)
    parts = [_cap(figure, head, bottom=0.3, hairline=0.52, thick=0.06)]
    top = head.shell(figure, (0.58, 0.9, 1.01), (1.09, 1.09, 0.9), (1.09, 1.09, 0.9), (1.09, 1.09, 0.9))
    return Hair([*parts, flat("head", top, figure.palette.skin)], None)


STYLES: dict[str, tuple[Callable[[Figure, Head], Hair], float, float]] = {
    "short": (_short, 0.30, 0.12),
    "bob": (_bob, 0.05, 0.20),
    "long": (_long, 0.07, 0.28),
    "spiky": (_spiky, 0.12, 0.05),
    "tied": (_tied, 0.05, 0.24),
    "mohawk": (_mohawk, 0.06, 0.02),
    "afro": (_afro, 0.05, 0.04),
    "block": (_block, 0.10, 0.01),
    "locks": (_locks, 0.04, 0.03),
    "bald": (_bald, 0.16, 0.01),
}


def make_hair(figure: Figure, head: Head) -> Hair:
    """Random hair that fits the figure."""
    if figure.surface in ("robot", "skeleton") and figure.chance(0.9):
        return Hair([], None)
    if figure.surface in ("fur", "creature") and figure.chance(0.75):
        return Hair([], None)
    weights = np.array([style[2 if figure.build.feminine else 1] for style in STYLES.values()])
    names = list(STYLES)
    name = names[int(figure.rng.choice(len(names), p=weights / weights.sum()))]
    if figure.build.name == "blocky" and name in ("short", "afro", "mohawk") and figure.chance(0.7):
        name = "block"
    return STYLES[name][0](figure, head)


def make_beard(figure: Figure, head: Head) -> list[Part]:
    """A beard that hangs from the chin."""
    build = figure.build
    chin, half = head.ring(figure, 0.1)
    drop = build.head * figure.between(0.1, 0.7)
    front = np.array((0.0, -0.75 * half[1], 0.0))
    path = np.stack(
        (
            chin + 1.2 * front - drop * UP,
            chin + front - 0.02 * build.head * UP,
            chin + front + 0.14 * build.head * UP,
        )
    )
    radii = half[0] * np.array(((figure.between(0.1, 0.6), 0.15), (0.9, 0.5), (0.95, 0.4)))
    return [_strands(figure, loft(path, radii, axis=UP, sides=8), "beard")]
