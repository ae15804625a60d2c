"""Trunk, arms, hands, legs and feet."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import FRONT, UP, Array, Shape, ball, box, loft, tube, unit
from charnerf.procedural.textures import Canvas, Color, darker

TRUNK_KNOTS = (0.0, 0.06, 0.14, 0.28, 0.42, 0.56, 0.68, 0.79, 0.88, 0.95, 1.0)


def trunk_shape(figure: Figure, *, margin: float = 1.0, low: float = 0.0, high: float = 1.0) -> Shape:
    """The trunk, or a shell of it between two shares of its height."""
    inner = [share for share in TRUNK_KNOTS if low < share < high]
    along = (low, *inner, high)
    rings = [figure.trunk(share, margin) for share in along]
    return loft(
        [centre for centre, _ in rings],
        [half for _, half in rings],
        axis=UP,
        sides=figure.build.sides,
        power=figure.build.power,
        along=(np.array(along) - low) / (high - low),
    )


def trunk_canvas(figure: Figure, color: Color, *, low: float = 0.0, high: float = 1.0) -> Canvas:
    """A canvas that fits trunk_shape between the same shares."""
    build = figure.build
    around = 4.0 * (build.waist + build.depth) if build.sides == 4 else 3.2 * (build.waist + build.depth)
    return Canvas(around, (high - low) * (build.shoulder_height - figure.trunk_bottom), color)


def limb(points: Array, along: Array, radii: Array, figure: Figure, *, front: Array = FRONT) -> Shape:
    """A tube along a bent limb (3 joints): rings at places along it (shares of its length), half sizes (k,) or (k, 2)."""
    first, second = np.linalg.norm(points[1] - points[0]), np.linalg.norm(points[2] - points[1])
    knots = np.array((0.0, first, first + second)) / (first + second)
    path = np.stack([np.interp(along, knots, points[:, axis]) for axis in range(3)], axis=-1)
    ends = (
        (0.0, 0.0)
        if figure.build.sides == 4
        else (0.3 * float(np.mean(radii[0])), 0.2 * float(np.mean(radii[-1])))
    )
    power = figure.build.power
    return loft(path, radii, front=front, sides=figure.build.sides, power=power, bulge=ends, along=along)


ARM_KNOTS = np.array((0.0, 0.06, 0.25, 0.45, 0.52, 0.7, 0.9, 1.0))
LEG_KNOTS = np.array((0.0, 0.08, 0.25, 0.45, 0.52, 0.72, 0.92, 1.0))


def arm_radii(figure: Figure, margin: float = 1.0) -> Array:
    """Radii at ARM_KNOTS, m."""
    shape = np.array((1.0, 1.12, 1.0, 0.88, 0.86, 0.92, 0.7, 0.66))
    if figure.build.name == "blob":
        shape = np.array((1.0, 1.0, 0.9, 0.9, 1.0, 1.1, 1.2, 1.15))
    if figure.build.sides == 4:
        shape = np.ones(8)
    return margin * figure.build.arm_radius * shape


def leg_radii(figure: Figure, margin: float = 1.0) -> Array:
    """Radii at LEG_KNOTS, m."""
    shape = np.array((1.0, 1.1, 1.0, 0.84, 0.82, 0.84, 0.6, 0.58))
    if figure.build.sides == 4:
        shape = np.ones(8)
    elif figure.build.name in ("chunky", "chibi", "blob"):
        shape = 0.5 + 0.5 * shape
    return margin * figure.build.leg_radius * shape


def make_arms(figure: Figure, canvases: tuple[Canvas, Canvas]) -> list[Part]:
    """Left and right arm, painted from shoulder (v = 0) to wrist."""
    parts = []
    for left, canvas in zip((True, False), canvases, strict=True):
        name = "left_arm" if left else "right_arm"
        shape = limb(figure.build.arm_points(left), ARM_KNOTS, arm_radii(figure), figure)
        texels = canvas.image()
        root = figure.build.arm_points(left)[0]
        inside = root * np.array((0.3, 1.0, 1.0)) + np.array((0.0, 0.0, 0.1 * figure.build.arm_radius))
        bridge = loft(
            np.stack((inside, root)),
            figure.build.arm_radius * np.array((0.9, 1.0)),
            sides=figure.build.sides,
            power=figure.build.power,
        )
        parts += [Part(name, shape, texels), flat(name, bridge, texels[-1].mean(axis=0) / 255.0)]
    return parts


def make_legs(figure: Figure, canvases: tuple[Canvas, Canvas], loose: float) -> list[Part]:
    """Left and right leg, painted from hip (v = 0) to ankle; loose trousers are wider below the knee."""
    parts = []
    radii = leg_radii(figure) * (1.0 + loose * np.clip(LEG_KNOTS - 0.3, 0.0, None))
    for left, canvas in zip((True, False), canvases, strict=True):
        name = "left_leg" if left else "right_leg"
        shape = limb(figure.build.leg_points(left), LEG_KNOTS, radii, figure)
        parts.append(Part(name, shape, canvas.image()))
    return parts


def limb_canvas(figure: Figure, color: Color, *, leg: bool) -> Canvas:
    """A canvas that fits an arm or a leg."""
    build = figure.build
    if leg:
        return Canvas(5.5 * build.leg_radius, build.hip_height - build.foot_height, color)
    return Canvas(5.5 * build.arm_radius, build.arm, color)


def hand_frame(figure: Figure, left: bool) -> tuple[Array, Array, Array]:
    """Wrist (3,), the direction that the hand points to (3,), and the hand's middle (3,)."""
    points = figure.build.arm_points(left)
    direction = unit(points[2] - points[1])
    return points[2], direction, points[2] + 0.45 * figure.build.hand * direction


def make_hands(figure: Figure, color: Color) -> list[Part]:
    """Mittens with a thumb, blocks, or hands with fingers."""
    build, parts = figure.build, []
    fingers = build.name == "realistic" or (build.name == "stylised" and figure.chance(0.5))
    style = (
        "block"
        if build.sides == 4
        else ("fingers" if fingers else figure.choose("mitten", "ball", "mitten", "block"))
    )
    claws = figure.surface in ("creature", "fur") and figure.chance(0.4)
    for left in (True, False):
        name = "left_hand" if left else "right_hand"
        wrist, along, _ = hand_frame(figure, left)
        flatness = unit(np.cross(along, FRONT))
        size = build.hand
        width = max(0.42 * size, 0.62 * build.arm_radius)
        if style == "block":
            reach = np.array((0.0, 0.5, 0.98)) * size
            half = np.full((3, 2), (0.98 if build.sides == 4 else 0.85) * build.arm_radius)
            parts.append(flat(name, loft(wrist + np.outer(reach, along), half, sides=4), color))
            continue
        if style == "ball":
            parts.append(flat(name, ball(wrist + 0.5 * size * along, 0.62 * size, sides=8, rings=6), color))
            continue
        reach = np.array((-0.12, 0.1, 0.55, 0.9)) * size
        half = np.array(((0.3, 0.5), (0.42, 0.85), (0.44, 1.0), (0.3, 0.85))) * width
        palm_end = 0.62 if style == "fingers" else 1.0
        parts.append(
            flat(name, tube(wrist + np.outer(reach * palm_end, along), half, sides=8, power=2.6), color)
        )
        thumb_root = wrist + 0.25 * size * along + 0.8 * width * FRONT
        thumb = np.stack((thumb_root - 0.3 * width * FRONT, thumb_root + 0.3 * size * (along + FRONT)))
        parts.append(flat(name, tube(thumb, np.array((0.24, 0.18)) * width, front=flatness, sides=6), color))
        if style == "fingers":
            for offset in (-0.66, -0.22, 0.22, 0.66):
                root = wrist + 0.45 * size * along + offset * width * FRONT
                tip = root + size * (0.62 - 0.14 * abs(offset)) * along
                parts.append(
                    flat(name, tube(np.stack((root, tip)), np.array((0.21, 0.16)) * width, sides=6), color)
                )
        if claws:
            for offset in (-0.5, 0.0, 0.5):
                root = wrist + 0.85 * size * along + offset * width * FRONT
                path = np.stack((root, root + 0.4 * size * along))
                parts.append(
                    flat(name, tube(path, np.array((0.22, 0.04)) * width, sides=5), (0.9, 0.88, 0.8))
                )
    return parts


def make_feet(figure: Figure, color: Color, *, bare: bool) -> list[Part]:
    """Shoes or bare feet: a loft from heel to toe, with a sole if shod."""
    build, parts = figure.build, []
    sole = figure.chance(0.55) and not bare
    sole_color = figure.palette.accent if figure.chance(0.25) else darker(color, 0.55)
    if figure.chance(0.2):
        sole_color = np.array((0.9, 0.9, 0.88))
    toe = figure.between(0.7, 1.15)
    pointed = figure.between(0.5, 1.0)
    for left in (True, False):
        name = "left_foot" if left else "right_foot"
        ankle = build.leg_points(left)[2]
        height = build.foot_height + 0.02
        half = max(0.68 * build.leg_radius, 0.055)
        back, front = 0.75 * build.leg_radius, build.foot - 0.75 * build.leg_radius
        bottom = 0.03 if sole else 0.0
        if build.sides == 4:
            middle = (ankle[0], ankle[1] - 0.12 * build.leg_radius, 0.5 * height)
            parts.append(
                flat(
                    name,
                    box(middle, (1.03 * build.leg_radius, 1.15 * build.leg_radius, 0.5 * height)),
                    color,
                )
            )
            continue
        along = np.array((-1.0, -0.6, 0.1, 0.6, 0.9, 1.0)) * np.where(np.arange(6) < 2, back, front)
        tall = np.array((0.7, 1.0, 1.0, 0.72 * toe, 0.55 * toe, 0.35)) * (height - bottom) * 0.5
        wide = half * np.array((0.7, 0.95, 1.0, 1.15 * toe, 0.95 * toe * pointed, 0.5 * pointed))
        path = np.stack((np.full(6, ankle[0]), ankle[1] - along, tall + bottom), axis=-1)
        shape = loft(
            path, np.stack((wide, tall), axis=-1), front=UP, axis=FRONT, sides=max(build.sides, 8), power=3.0
        )
        parts.append(flat(name, shape, color))
        if sole:
            span = np.array((-1.05 * back, -0.5 * back, 0.5 * front, 0.92 * front, 1.06 * front))
            width = half * np.array((0.7, 1.02, 1.15 * toe, 1.0 * toe * pointed + 0.05, 0.4))
            path = np.stack((np.full(5, ankle[0]), ankle[1] - span, np.full(5, 0.018)), axis=-1)
            plate = loft(
                path, np.stack((width, np.full(5, 0.018)), axis=-1), front=UP, axis=FRONT, sides=8, power=5.0
            )
            parts.append(flat(name, plate, sole_color))
    return parts


def make_neck(figure: Figure, color: Color) -> list[Part]:
    """A short tube between trunk and head."""
    build = figure.build
    if build.name == "blocky":
        return []
    radius = min(0.45 * build.head_width, 0.55 * build.waist)
    if build.name == "realistic":
        radius = 0.055 if not build.feminine else 0.047
    bottom, _ = figure.trunk(0.93)
    top = build.head_centre + np.array((0.0, 0.12 * build.head_depth, -0.3 * build.head))
    shape = loft(np.stack((bottom, 0.5 * (bottom + top), top)), np.array((1.15, 1.0, 1.0)) * radius, sides=8)
    return [flat("neck", shape, color)]
