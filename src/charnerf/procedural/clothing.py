"""Clothes that are modelled: belts, skirts, capes, scarves, tabards."""

import numpy as np

from charnerf.procedural import body
from charnerf.procedural.figure import Figure
from charnerf.procedural.outfit import Outfit
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import (
    FRONT,
    UP,
    ball,
    box,
    loft,
    sheet,
)
from charnerf.procedural.textures import (
    NUM_EMBLEMS,
    Canvas,
    add_emblem,
    add_pattern,
    darker,
)


def make_belt(figure: Figure) -> list[Part]:
    """A belt with a buckle, pouches at times."""
    palette = figure.palette
    low = figure.between(0.14, 0.24)
    color = palette.leather if figure.chance(0.75) else palette.second
    parts = [flat("belt", body.trunk_shape(figure, margin=1.07, low=low, high=low + 0.07), color)]
    centre, half = figure.trunk(low + 0.035, 1.08)
    size = 0.05 * (0.5 + figure.build.depth / 0.2)
    buckle = np.array((0.0, -half[1], 0.0)) + centre
    parts.append(
        flat(
            "belt",
            box(buckle, (size, 0.015, 0.7 * size)),
            palette.accent if figure.chance(0.5) else palette.metal,
        )
    )
    for side in (-1.0, 1.0):
        if figure.chance(0.3):
            pouch = centre + np.array((side * 0.75 * half[0], -0.72 * half[1], -0.04))
            parts.append(
                flat("belt", box(pouch, (1.1 * size, 0.7 * size, 1.2 * size), taper=0.9), darker(color, 0.85))
            )
    return parts


def make_skirt(figure: Figure, outfit: Outfit) -> list[Part]:
    """A skirt, kilt, robe or coat tail: a bell from the waist to a length, its canvas striped or hemmed."""
    build, palette = figure.build, figure.palette
    long = figure.choose("mini", "knee", "knee", "long", "floor")
    share = {"mini": 0.25, "knee": 0.5, "long": 0.75, "floor": 0.97}[long]
    start = figure.between(0.2, 0.42)
    top, half = figure.trunk(start, 1.05)
    bottom = build.hip_height - share * (build.hip_height - 0.02)
    leg = build.leg_points(True)
    reach = abs(float(np.interp(bottom, leg[::-1, 2], leg[::-1, 0]))) + 1.05 * build.leg_radius
    hips, hip_half = figure.trunk(0.12, 1.12)
    flare = figure.between(1.0, 1.5)
    rings = [(top, half), (hips, hip_half)]
    end = np.array((max(reach, hip_half[0]) * flare, max(1.2 * build.leg_radius, hip_half[1]) * flare))
    low_end = np.array((0.0, 0.0, bottom))
    rings += [(0.5 * (hips + low_end), 0.5 * (hip_half + end) * 1.02), (low_end, end)]
    rings.reverse()
    color = outfit.top if figure.chance(0.6) else palette.second
    canvas = Canvas(3.0 * float(end.sum()), float(top[2] - bottom), color)
    if figure.chance(0.35):
        add_pattern(canvas, figure.rng, palette.second if figure.chance(0.5) else darker(color, 0.75))
    if figure.chance(0.5):
        canvas.band(
            0.0, figure.between(0.06, 0.16), palette.accent if figure.chance(0.5) else darker(color, 0.65)
        )
    opening = figure.choose("none", "none", "front", "apron", "back")
    if opening == "front":
        wide = figure.between(0.02, 0.09)
        canvas.paint(np.abs(canvas.u - 0.5) < wide * (1.15 - canvas.v), palette.trousers)
    elif opening == "apron":
        canvas.paint((np.abs(canvas.u - 0.5) < 0.14) & (canvas.v > 0.1), palette.accent)
    elif opening == "back":
        canvas.strip(0.0, 0.05, palette.accent)
    canvas.shade(1.0, figure.shade)
    bell = loft(
        [centre for centre, _ in rings],
        [size for _, size in rings],
        axis=UP,
        sides=max(build.sides, 8) if build.sides != 4 else 4,
        power=2.3 if build.sides != 4 else 4.0,
    )
    return [Part("skirt", bell, canvas.image())]


def make_cape(figure: Figure) -> list[Part]:
    """A cape behind, hanging from the shoulders."""
    build, palette = figure.build, figure.palette
    top, half = figure.trunk(0.9, 1.1)
    bottom = figure.between(0.08, 0.6) * build.hip_height
    rows = 6
    fall = np.linspace(0.0, 1.0, rows)
    wide = np.interp(fall, (0.0, 0.3, 1.0), (0.75, 1.05, figure.between(1.0, 1.5))) * build.shoulder
    back = half[1] * 1.15 + fall * figure.between(0.02, 0.3)
    columns = np.linspace(1.0, -1.0, 7)  # seen from behind, the picture's right is -X's opposite
    wave = figure.between(0.0, 0.03)
    x = wide[:, None] * columns
    y = (
        top[1]
        + back[:, None]
        - 0.55 * half[1] * (columns**4) * (1.0 - 0.6 * fall[:, None])
        + wave * np.sin(9.0 * columns) * fall[:, None]
    )
    z = top[2] + 0.02 - fall[:, None] * (top[2] - bottom) + 0.0 * columns
    grid = np.stack((x, y, z), axis=-1)[::-1]
    color = palette.accent if figure.chance(0.4) else palette.second
    canvas = Canvas(2.0 * float(wide.max()), float(top[2] - bottom), color)
    if figure.chance(0.25):
        add_pattern(canvas, figure.rng, darker(color, 0.7))
    if figure.chance(0.45):
        canvas.band(0.0, 0.08, palette.main)
        canvas.paint((canvas.u < 0.06) | (canvas.u > 0.94), palette.main)
    if figure.chance(0.4):
        add_emblem(
            canvas, (0.5, 0.6), 0.4 * float(wide[2]), int(figure.rng.integers(NUM_EMBLEMS)), palette.main
        )
    canvas.shade(1.0, figure.shade)
    collar = body.trunk_shape(figure, margin=1.18, low=0.85, high=0.98)
    parts = [Part("cape", sheet(grid, 0.025), canvas.image()), flat("cape", collar, darker(color, 0.85))]
    if figure.chance(0.5):
        clasp, size = figure.trunk(0.9, 1.2)
        parts.append(flat("cape", ball(clasp + size[1] * FRONT, 0.035, sides=8, rings=5), palette.metal))
    return parts


def make_scarf(figure: Figure) -> list[Part]:
    """A scarf or high collar, perhaps with a loose end."""
    build = figure.build
    color = figure.palette.accent if figure.chance(0.6) else figure.palette.second
    centre, _ = figure.trunk(0.98)
    wide = max(0.62 * build.head_width, 0.5 * build.waist)
    rings = np.outer((-0.05, 0.0, 0.06), UP) * (0.5 + build.head) + centre
    half = np.array((1.0, 1.12, 0.95))[:, None] * np.array((wide, min(0.9 * wide, 0.9 * build.depth + 0.03)))
    parts = [flat("scarf", loft(rings, half, axis=UP, sides=10), color)]
    if figure.chance(0.5):
        side = 0.4 * wide if figure.chance(0.5) else -0.4 * wide
        ahead = -1.0 if figure.chance(0.6) else 1.0
        top = centre + np.array((side, ahead * half[1, 1], 0.0))
        drop = figure.between(0.15, 0.4)
        path = np.stack(
            (
                top,
                top + np.array((0.0, ahead * 0.06, -0.5 * drop)),
                top + np.array((0.02, ahead * 0.04, -drop)),
            )
        )
        parts.append(
            flat(
                "scarf",
                loft(path, np.array(((0.05, 0.025), (0.06, 0.02), (0.06, 0.02))), sides=4),
                darker(color, 0.85),
            )
        )
    return parts


def make_tabard(figure: Figure) -> list[Part]:
    """Cloth hanging from the belt in front, and often behind."""
    build, palette, parts = figure.build, figure.palette, []
    top, half = figure.trunk(0.22, 1.01)
    bottom = build.hip_height * figure.between(0.35, 0.75)
    wide = build.waist * figure.between(0.35, 0.7)
    color = palette.accent if figure.chance(0.5) else palette.main
    for ahead in (-1.0, 1.0) if figure.chance(0.6) else (-1.0,):
        canvas = Canvas(2.0 * wide, float(top[2] - bottom), color)
        canvas.band(0.0, 0.12, palette.second)
        if ahead < 0.0 and figure.chance(0.5):
            add_emblem(canvas, (0.5, 0.5), 0.5 * wide, int(figure.rng.integers(NUM_EMBLEMS)), palette.second)
        columns = np.linspace(-1.0, 1.0, 3) * -ahead
        fall = np.linspace(1.0, 0.0, 4)[:, None]
        x = wide * columns * (1.0 - 0.15 * fall)
        front = half[1] + fall * max(0.03, 1.1 * build.leg_radius + 0.03 - half[1])
        y = top[1] + ahead * front + 0.0 * columns
        z = top[2] - fall * (top[2] - bottom) + 0.0 * columns
        parts.append(Part("tabard", sheet(np.stack((x, y, z), axis=-1), 0.02), canvas.image()))
    return parts
