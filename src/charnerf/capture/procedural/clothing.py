"""Clothes and armour that are modelled: belts, skirts, coats, capes, scarves, boots, gloves, plates."""

import numpy as np

from charnerf.capture.procedural import body
from charnerf.capture.procedural.figure import Figure
from charnerf.capture.procedural.outfit import Outfit
from charnerf.capture.procedural.parts import Part, flat
from charnerf.capture.procedural.shapes import FRONT, UP, Array, ball, box, loft, sheet, tube, unit
from charnerf.capture.procedural.textures import NUM_EMBLEMS, Canvas, Colour, add_emblem, add_pattern, darker


def _limb_shell(figure: Figure, name: str, points: Array, radii: Array, span: tuple[float, float], flare: tuple[float, float], colour: Colour) -> Part:  # fmt: skip
    """A sleeve around a limb over a span of its length, its radius times flare at either end."""
    shares = np.linspace(span[0], span[1], 4)
    known = body.LEG_SHARES if "leg" in name or "boot" in name else body.ARM_SHARES
    sizes = np.interp(shares, known, radii) * np.linspace(flare[0], flare[1], 4) + 0.006
    return flat(name, body.limb(points, shares, sizes, figure), colour)


def make_belt(figure: Figure) -> list[Part]:
    """A belt with a buckle, pouches at times."""
    palette = figure.palette
    low = figure.between(0.14, 0.24)
    colour = palette.leather if figure.chance(0.75) else palette.second
    parts = [flat("belt", body.trunk_shape(figure, margin=1.07, low=low, high=low + 0.07), colour)]
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
                flat(
                    "belt", box(pouch, (1.1 * size, 0.7 * size, 1.2 * size), taper=0.9), darker(colour, 0.85)
                )
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
    colour = outfit.top if figure.chance(0.6) else palette.second
    canvas = Canvas(3.0 * float(end.sum()), float(top[2] - bottom), colour)
    if figure.chance(0.35):
        add_pattern(canvas, figure.rng, palette.second if figure.chance(0.5) else darker(colour, 0.75))
    if figure.chance(0.5):
        canvas.band(
            0.0, figure.between(0.06, 0.16), palette.accent if figure.chance(0.5) else darker(colour, 0.65)
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
        [centre for centre, _ in rings], [size for _, size in rings], axis=UP, sides=max(build.sides, 8) if build.sides != 4 else 4,
        power=2.3 if build.sides != 4 else 4.0,
    )  # fmt: skip
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
    colour = palette.accent if figure.chance(0.4) else palette.second
    canvas = Canvas(2.0 * float(wide.max()), float(top[2] - bottom), colour)
    if figure.chance(0.25):
        add_pattern(canvas, figure.rng, darker(colour, 0.7))
    if figure.chance(0.45):
        canvas.band(0.0, 0.08, palette.main)
        canvas.paint((canvas.u < 0.06) | (canvas.u > 0.94), palette.main)
    if figure.chance(0.4):
        add_emblem(
            canvas, 0.5, 0.6, 0.4 * float(wide[2]), int(figure.rng.integers(NUM_EMBLEMS)), palette.main
        )
    canvas.shade(1.0, figure.shade)
    collar = body.trunk_shape(figure, margin=1.18, low=0.85, high=0.98)
    parts = [Part("cape", sheet(grid, 0.025), canvas.image()), flat("cape", collar, darker(colour, 0.85))]
    if figure.chance(0.5):
        clasp, size = figure.trunk(0.9, 1.2)
        parts.append(flat("cape", ball(clasp + size[1] * FRONT, 0.035, sides=8, rings=5), palette.metal))
    return parts


def make_scarf(figure: Figure) -> list[Part]:
    """A scarf or high collar, perhaps with a loose end."""
    build = figure.build
    colour = figure.palette.accent if figure.chance(0.6) else figure.palette.second
    centre, _ = figure.trunk(0.98)
    wide = max(0.62 * build.head_width, 0.5 * build.waist)
    rings = np.outer((-0.05, 0.0, 0.06), UP) * (0.5 + build.head) + centre
    half = np.array((1.0, 1.12, 0.95))[:, None] * np.array((wide, min(0.9 * wide, 0.9 * build.depth + 0.03)))
    parts = [flat("scarf", loft(rings, half, axis=UP, sides=10), colour)]
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
                darker(colour, 0.85),
            )
        )
    return parts


def make_boots(figure: Figure) -> list[Part]:
    """Boots or greaves around the lower legs."""
    start = figure.between(0.5, 0.85)
    colour = figure.palette.metal if figure.chance(0.2) else figure.palette.boots
    parts = []
    rim = figure.chance(0.4)
    flare = (figure.between(1.12, 1.4), 1.15)
    for left in (True, False):
        name = "left_boot" if left else "right_boot"
        points, radii = figure.build.leg_points(left), body.leg_radii(figure)
        parts.append(_limb_shell(figure, name, points, radii, (start, 1.0), flare, colour))
        if rim:
            wide = (flare[0] * 1.1, flare[0] * 1.1)
            parts.append(
                _limb_shell(
                    figure, name, points, radii, (start - 0.02, start + 0.05), wide, figure.palette.accent
                )
            )
    return parts


def make_bracers(figure: Figure) -> list[Part]:
    """Bracers, gauntlets or wide sleeves around the forearms; at times on one arm only."""
    parts = []
    sleeve = figure.chance(0.35)
    colour = (
        figure.palette.main
        if sleeve
        else (figure.palette.metal if figure.chance(0.4) else figure.palette.leather)
    )
    start = figure.between(0.3, 0.55) if sleeve else figure.between(0.58, 0.75)
    flare = (1.1, figure.between(1.5, 2.6)) if sleeve else (figure.between(1.15, 1.5), 1.2)
    only_left = figure.chance(0.15)
    for left in (True,) if only_left else (True, False):
        name = "left_bracer" if left else "right_bracer"
        parts.append(
            _limb_shell(
                figure,
                name,
                figure.build.arm_points(left),
                body.arm_radii(figure),
                (start, 0.98),
                flare,
                colour,
            )
        )
    return parts


def make_pauldrons(figure: Figure) -> list[Part]:
    """Shoulder plates: domes, layers, spikes; at times on one side only."""
    build, parts = figure.build, []
    colour = figure.palette.metal if figure.chance(0.7) else figure.palette.leather
    grow, layers, spike = figure.between(1.35, 2.0), int(figure.rng.integers(1, 4)), figure.chance(0.25)
    sides = (True,) if figure.chance(0.25) else (True, False)
    for left in sides:
        points = build.arm_points(left)
        along = unit(points[1] - points[0])
        up = unit(UP - 0.6 * along * (along @ UP))
        for layer in range(layers):
            size = build.arm_radius * grow * (1.0 - 0.12 * layer)
            at = points[0] + along * build.arm_radius * (0.15 + 0.75 * layer) + up * build.arm_radius * 0.25
            shade = darker(colour, 1.0 - 0.14 * layer)
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
    colour = palette.metal if figure.chance(0.65) else palette.leather
    canvas = body.trunk_canvas(figure, colour, low=low, high=high)
    edge = darker(colour, 0.65) if figure.chance(0.6) else palette.accent
    canvas.band(0.0, 0.1, edge)
    canvas.band(0.92, 1.0, edge)
    if figure.chance(0.5):
        canvas.strip(0.5, 0.008, darker(colour, 0.75))
    if figure.chance(0.4):
        half = 0.35 * figure.build.waist
        add_emblem(canvas, 0.5, 0.6, half, int(figure.rng.integers(NUM_EMBLEMS)), palette.accent)
    if figure.chance(0.5):
        canvas.strip(0.0, 0.05, palette.leather)
    canvas.shade(1.0, min(figure.shade, 0.9))
    return [Part("breastplate", body.trunk_shape(figure, margin=1.09, low=low, high=high), canvas.image())]


def make_tabard(figure: Figure) -> list[Part]:
    """Cloth hanging from the belt in front, and often behind."""
    build, palette, parts = figure.build, figure.palette, []
    top, half = figure.trunk(0.22, 1.01)
    bottom = build.hip_height * figure.between(0.35, 0.75)
    wide = build.waist * figure.between(0.35, 0.7)
    colour = palette.accent if figure.chance(0.5) else palette.main
    for ahead in (-1.0, 1.0) if figure.chance(0.6) else (-1.0,):
        canvas = Canvas(2.0 * wide, float(top[2] - bottom), colour)
        canvas.band(0.0, 0.12, palette.second)
        if ahead < 0.0 and figure.chance(0.5):
            add_emblem(canvas, 0.5, 0.5, 0.5 * wide, int(figure.rng.integers(NUM_EMBLEMS)), palette.second)
        columns = np.linspace(-1.0, 1.0, 3) * -ahead
        fall = np.linspace(1.0, 0.0, 4)[:, None]
        x = wide * columns * (1.0 - 0.15 * fall)
        front = half[1] + fall * max(0.03, 1.1 * build.leg_radius + 0.03 - half[1])
        y = top[1] + ahead * front + 0.0 * columns
        z = top[2] - fall * (top[2] - bottom) + 0.0 * columns
        parts.append(Part("tabard", sheet(np.stack((x, y, z), axis=-1), 0.02), canvas.image()))
    return parts


def make_robot_joints(figure: Figure) -> list[Part]:
    """Balls at a robot's shoulders, elbows and knees."""
    parts = []
    build, colour = figure.build, darker(figure.palette.metal, figure.between(0.6, 1.0))
    for left in (True, False):
        arm, leg = build.arm_points(left), build.leg_points(left)
        for point, radius in ((arm[0], 1.3), (arm[1], 1.08)):
            parts.append(flat("joints", ball(point, radius * build.arm_radius, sides=8, rings=6), colour))
        parts.append(flat("joints", ball(leg[1], 1.0 * build.leg_radius, sides=8, rings=6), colour))
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
