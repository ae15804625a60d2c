"""Armour, boots and bracers, robots' joints and skeletons' ribs."""

import numpy as np

from charnerf.procedural import body
from charnerf.procedural.figure import Figure
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import (
    UP,
    ball,
    loft,
    tube,
    unit,
)
from charnerf.procedural.textures import (
    NUM_EMBLEMS,
    Color,
    add_emblem,
    darker,
)


def _limb_shell(
    figure: Figure,
    name: str,
    color: Color,
    *,
    span: tuple[float, float],
    flare: tuple[float, float],
) -> Part:
    """A sleeve around the limb of a name such as "left_boot": over a span of it, radius times flare."""
    left, leg = name.startswith("left"), name.endswith("boot")
    points = figure.build.leg_points(left) if leg else figure.build.arm_points(left)
    knots, radii = (
        (body.LEG_KNOTS, body.leg_radii(figure)) if leg else (body.ARM_KNOTS, body.arm_radii(figure))
    )
    along = np.linspace(span[0], span[1], 4)
    sizes = np.interp(along, knots, radii) * np.linspace(flare[0], flare[1], 4) + 0.006
    return flat(name, body.limb(points, along, sizes, figure), color)


def make_boots(figure: Figure) -> list[Part]:
    """Boots or greaves around the lower legs."""
    start = figure.between(0.5, 0.85)
    color = figure.palette.metal if figure.chance(0.2) else figure.palette.boots
    parts = []
    rim = figure.chance(0.4)
    flare = (figure.between(1.12, 1.4), 1.15)
    for name in ("left_boot", "right_boot"):
        parts.append(_limb_shell(figure, name, color, span=(start, 1.0), flare=flare))
        if rim:
            wide = (flare[0] * 1.1, flare[0] * 1.1)
            top = (start - 0.02, start + 0.05)
            parts.append(_limb_shell(figure, name, figure.palette.accent, span=top, flare=wide))
    return parts


def make_bracers(figure: Figure) -> list[Part]:
    """Bracers, gauntlets or wide sleeves around the forearms; at times on one arm only."""
    parts = []
    sleeve = figure.chance(0.35)
    color = (
        figure.palette.main
        if sleeve
        else (figure.palette.metal if figure.chance(0.4) else figure.palette.leather)
    )
    start = figure.between(0.3, 0.55) if sleeve else figure.between(0.58, 0.75)
    flare = (1.1, figure.between(1.5, 2.6)) if sleeve else (figure.between(1.15, 1.5), 1.2)
    only_left = figure.chance(0.15)
    for name in ("left_bracer",) if only_left else ("left_bracer", "right_bracer"):
        parts.append(_limb_shell(figure, name, color, span=(start, 0.98), flare=flare))
    return parts


def make_pauldrons(figure: Figure) -> list[Part]:
    """Shoulder plates: domes, layers, spikes; at times on one side only."""
    build, parts = figure.build, []
    color = figure.palette.metal if figure.chance(0.7) else figure.palette.leather
    grow, layers, spike = figure.between(1.35, 2.0), int(figure.rng.integers(1, 4)), figure.chance(0.25)
    sides = (True,) if figure.chance(0.25) else (True, False)
    for left in sides:
        points = build.arm_points(left)
        along = unit(points[1] - points[0])
        up = unit(UP - 0.6 * along * (along @ UP))
        for layer in range(layers):
            size = build.arm_radius * grow * (1.0 - 0.12 * layer)
            at = points[0] + along * build.arm_radius * (0.15 + 0.75 * layer) + up * build.arm_radius * 0.25
            shade = darker(color, 1.0 - 0.14 * layer)
            dome = ball(
                at, (size, size, 0.85 * size), sides=8, rings=6, power=2.0 if not figure.crisp else 3.5
            )
            parts.append(flat("pauldrons", dome, shade))
        if spike:
            root = points[0] + up * build.arm_radius * grow * 0.8
            tip = root + build.arm_radius * 1.5 * unit(up + 0.5 * along)
            radii = build.arm_radius * np.array((0.45, 0.03))
            parts.append(
                flat("pauldrons", loft(np.stack((root, tip)), radii, sides=6), figure.palette.accent)
            )
    return parts


def make_breastplate(figure: Figure) -> list[Part]:
    """A plate or a vest around the chest, painted with edges and an emblem in front."""
    palette = figure.palette
    low, high = figure.between(0.3, 0.5), figure.between(0.86, 0.95)
    color = palette.metal if figure.chance(0.65) else palette.leather
    canvas = body.trunk_canvas(figure, color, low=low, high=high)
    edge = darker(color, 0.65) if figure.chance(0.6) else palette.accent
    canvas.band(0.0, 0.1, edge)
    canvas.band(0.92, 1.0, edge)
    if figure.chance(0.5):
        canvas.strip(0.5, 0.008, darker(color, 0.75))
    if figure.chance(0.4):
        half = 0.35 * figure.build.waist
        add_emblem(canvas, (0.5, 0.6), half, int(figure.rng.integers(NUM_EMBLEMS)), palette.accent)
    if figure.chance(0.5):
        canvas.strip(0.0, 0.05, palette.leather)
    canvas.shade(1.0, min(figure.shade, 0.9))
    return [Part("breastplate", body.trunk_shape(figure, margin=1.09, low=low, high=high), canvas.image())]


def make_robot_joints(figure: Figure) -> list[Part]:
    """Balls at a robot's shoulders, elbows and knees."""
    parts = []
    build, color = figure.build, darker(figure.palette.metal, figure.between(0.6, 1.0))
    for left in (True, False):
        arm, leg = build.arm_points(left), build.leg_points(left)
        for point, radius in ((arm[0], 1.3), (arm[1], 1.08)):
            parts.append(flat("joints", ball(point, radius * build.arm_radius, sides=8, rings=6), color))
        parts.append(flat("joints", ball(leg[1], 1.0 * build.leg_radius, sides=8, rings=6), color))
    return parts


def make_ribs(figure: Figure) -> list[Part]:
    """A skeleton's ribs and pelvis over a thin spine."""
    parts, bone = [], figure.palette.skin
    bottom, _ = figure.trunk(0.05)
    top, _ = figure.trunk(1.0)
    radius = 0.2 * figure.build.waist
    parts.append(
        flat("trunk", tube(np.stack((bottom, 0.5 * (bottom + top), top)), np.full(3, radius), sides=8), bone)
    )
    for share in np.linspace(0.5, 0.92, int(figure.rng.integers(3, 6))):
        centre, half = figure.trunk(share, 0.95)
        ring = np.outer((-0.02, 0.02), UP) * (0.4 + 2.0 * figure.build.depth) + centre
        parts.append(
            flat(
                "trunk",
                loft(ring, np.stack((half, half)), axis=UP, sides=10),
                darker(bone, figure.between(0.9, 1.0)),
            )
        )
    centre, half = figure.trunk(0.1, 0.9)
    parts.append(flat("trunk", ball(centre, (half[0], half[1], 0.08), sides=8, rings=5), bone))
    return parts
