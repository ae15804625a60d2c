"""Heads: their form, painted faces, noses, ears and horns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from charnerf.capture.procedural.figure import Figure
from charnerf.capture.procedural.palette import BLACK, WHITE
from charnerf.capture.procedural.parts import Part, flat
from charnerf.capture.procedural.shapes import UP, Array, Shape, ball, box, loft, tube
from charnerf.capture.procedural.textures import Canvas, Colour, darker, mix

LEVELS = np.array((0.0, 0.08, 0.2, 0.35, 0.5, 0.65, 0.8, 0.92, 0.985))
WIDTHS: dict[str, tuple[float, ...]] = {
    "egg": (0.36, 0.56, 0.74, 0.90, 0.98, 1.0, 0.93, 0.68, 0.30),
    "round": (0.30, 0.54, 0.80, 0.96, 1.0, 0.96, 0.80, 0.54, 0.25),
    "jaw": (0.62, 0.76, 0.86, 0.92, 0.97, 1.0, 0.94, 0.70, 0.34),
    "cheeks": (0.50, 0.82, 0.98, 1.0, 0.97, 0.92, 0.80, 0.56, 0.26),
    "block": (0.92, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.92),
    "bucket": (0.84, 0.90, 0.94, 0.97, 1.0, 1.0, 0.98, 0.90, 0.62),
    "skull": (0.56, 0.66, 0.68, 0.80, 0.98, 1.0, 0.94, 0.70, 0.32),
}


@dataclass(frozen=True)
class Head:
    """The form of a head: relative widths at LEVELS, cross-section, and how far u = 0.5 +- du reaches sideways.

    face_width_m is the length that u would span if the front went all around.
    """

    form: str
    sides: int
    power: float
    face_width_m: float

    def ring(self, figure: Figure, level: float) -> tuple[Array, Array]:
        """Centre (3,) and half sizes (2,) at a level in [0, 1] from chin to crown."""
        build = figure.build
        width = float(np.interp(level, LEVELS, WIDTHS[self.form]))
        centre = build.head_centre + (level - 0.5) * build.head * UP
        jut = 0.10 * build.head_depth * max(0.0, 0.35 - level) if self.form in ("jaw", "egg") else 0.0
        depth = build.head_depth * (0.35 + 0.65 * width)
        return centre - np.array((0.0, jut, 0.0)), np.array((build.head_width * width, depth))

    def shell(
        self,
        figure: Figure,
        levels: ArrayLike,
        sideways: ArrayLike,
        fronts: ArrayLike,
        backs: ArrayLike,
        *,
        floor: float = 0.3,
    ) -> Shape:
        """A closed shape around the head: how far it reaches at each level, in half sizes of the head there.

        Levels outside [floor, 0.92] take the head's size at that limit.
        """
        centres, sizes = [], []
        rows = np.stack(
            np.broadcast_arrays(*(np.asarray(row, float) for row in (levels, sideways, fronts, backs))),
            axis=-1,
        )
        for level, side, ahead, behind in rows:
            inside = min(max(level, floor), 0.92)
            centre, half = self.ring(figure, inside)
            centre = centre + (level - inside) * figure.build.head * UP
            centres.append(centre + np.array((0.0, 0.5 * (behind - ahead) * half[1], 0.0)))
            sizes.append((side * half[0], max(0.5 * (behind + ahead) * half[1], 0.01)))
        top = 0.02 * figure.build.head
        return loft(centres, sizes, axis=UP, sides=self.sides, power=self.power, bulge=(0.0, top))


def make_head_form(figure: Figure) -> Head:
    """Choose the form of a head for a figure."""
    build = figure.build
    forms = {
        "realistic": ("egg", "jaw"), "stylised": ("egg", "round", "jaw", "bucket"), "chunky": ("jaw", "bucket", "block", "round"),
        "chibi": ("cheeks", "round", "bucket", "block"), "giant": ("jaw", "bucket", "round"), "blob": ("bucket", "cheeks", "round"),
        "blocky": ("block",),
    }[build.name]  # fmt: skip
    form = "skull" if figure.surface == "skeleton" and build.name != "blocky" else figure.choose(*forms)
    sides = 4 if build.name == "blocky" else max(build.sides, 8)
    if figure.surface == "robot" and figure.chance(0.5):
        form = "block"
    power = figure.between(3.5, 7.0) if form in ("block",) else build.power
    return Head(form, sides, power, (8.0 if sides == 4 else 2.0 * np.pi) * build.head_width)


def head_shape(figure: Figure, head: Head) -> Shape:
    """The bare head."""
    rings = [head.ring(figure, level) for level in LEVELS]
    tip = 0.015 * figure.build.head
    bulge = (0.0, 0.0) if head.form == "block" else (tip, tip)
    return loft(
        [centre for centre, _ in rings], [half for _, half in rings], axis=UP, sides=head.sides, power=head.power, bulge=bulge,
        along=LEVELS,
    )  # fmt: skip


def _eyes(figure: Figure, canvas: Canvas, eye_level: float) -> None:
    """Two painted eyes in one of several styles, with brows."""
    half_width, cute = figure.build.head_width, figure.build.name in ("chibi", "blob")
    apart = half_width * figure.between(0.32, 0.46)
    size = half_width * (figure.between(0.12, 0.22) if cute else figure.between(0.09, 0.15))
    tall = size * (figure.between(1.0, 1.9) if cute else figure.between(0.6, 1.1))
    style = figure.choose("dot", "white", "white", "anime" if cute else "white", "dot", "slant", "happy")
    iris, brow = figure.palette.eyes, darker(figure.palette.hair, figure.between(0.5, 0.95))
    tilt = figure.between(-0.35, 0.35)
    brows = figure.chance(0.75)
    for side in (-1.0, 1.0):
        u = 0.5 + side * apart / canvas.width_m
        if style in ("dot", "slant"):
            canvas.ellipse(u, eye_level, 0.8 * size, tall, BLACK if figure.surface != "skeleton" else iris)
        elif style == "happy":
            canvas.ellipse(u, eye_level, size, 0.8 * tall, BLACK)
            canvas.ellipse(
                u, eye_level - 0.4 * tall / canvas.height_m, 0.8 * size, 0.7 * tall, figure.palette.skin
            )
        else:
            canvas.ellipse(
                u, eye_level, 1.15 * size, 1.1 * tall, BLACK if cute else darker(figure.palette.skin, 0.6)
            )
            canvas.ellipse(u, eye_level, size, tall, WHITE)
            canvas.ellipse(u, eye_level, 0.62 * size, 0.8 * tall, iris)
            canvas.ellipse(u, eye_level, 0.3 * size, 0.42 * tall, BLACK)
            canvas.ellipse(
                u + 0.2 * size / canvas.width_m,
                eye_level + 0.3 * tall / canvas.height_m,
                0.2 * size,
                0.2 * tall,
                WHITE,
            )
        if brows:
            height = eye_level + (1.45 * tall + 0.3 * size) / canvas.height_m
            canvas.rectangle(u, height, 1.25 * size, 0.26 * size, brow, tilt=side * tilt)


def _mouth(figure: Figure, canvas: Canvas, level: float) -> None:
    """A painted mouth."""
    half = figure.build.head_width * figure.between(0.14, 0.32)
    dark = darker(mix(figure.palette.skin, (0.5, 0.1, 0.1), 0.5), 0.75)
    style = figure.choose("line", "smile", "open", "lips", "none", "teeth", "frown")
    thin = 0.035 * figure.build.head_width + 0.002
    x, y = canvas.local(0.5, level)
    if style == "line":
        canvas.rectangle(0.5, level, half, thin, dark)
    elif style in ("smile", "frown"):
        bend = (0.35 if style == "smile" else -0.3) * (x / half) ** 2 * half
        canvas.paint((np.abs(x) < half) & (np.abs(y - bend) < 1.2 * thin), dark)
    elif style in ("open", "teeth"):
        canvas.ellipse(0.5, level, half, 0.5 * half, darker(dark, 0.6))
        if style == "teeth":
            canvas.paint(
                (np.abs(x) < 0.8 * half) & (np.abs(y) < 0.2 * half) & ((x / half * 3.0) % 1.0 < 0.8), WHITE
            )
    elif style == "lips":
        canvas.ellipse(0.5, level, 0.8 * half, 0.28 * half, mix(figure.palette.skin, (0.75, 0.15, 0.2), 0.55))


def _beard(figure: Figure, canvas: Canvas) -> None:
    """Stubble, moustache or beard in paint."""
    colour = (
        figure.palette.hair if figure.chance(0.6) else mix(figure.palette.skin, figure.palette.hair, 0.45)
    )
    x, y = canvas.local(0.5, 0.0)
    x, y = np.abs(x) / figure.build.head_width, y / figure.build.head
    kind = figure.choose("full", "chin", "moustache", "stubble")
    if kind in ("full", "stubble"):
        mouth = (x < 0.25) & (np.abs(y - 0.22) < 0.03)
        canvas.paint(
            (y < 0.16 + 0.22 * np.clip(x, 0.0, 1.2)) & (x < 1.25) & ~mouth,
            colour,
            1.0 if kind == "full" else 0.5,
        )
    if kind in ("chin",):
        canvas.paint((y < 0.14) & (x < 0.4), colour)
    if kind in ("moustache", "full"):
        canvas.paint((np.abs(y - 0.28 + 0.1 * x) < 0.035) & (x < 0.45), colour)


def _human_face(figure: Figure, canvas: Canvas) -> None:
    cute = figure.build.name in ("chibi", "blob")
    eye_level = figure.between(0.34, 0.46) if cute else figure.between(0.46, 0.56)
    if figure.chance(0.2):
        cheek = mix(figure.palette.skin, (0.95, 0.4, 0.4), 0.4)
        for side in (-1.0, 1.0):
            radius = 0.16 * figure.build.head_width
            canvas.ellipse(0.5 + side * 0.09, eye_level - 0.16, radius, 0.7 * radius, cheek)
    if not figure.build.feminine and figure.surface == "human" and figure.chance(0.35):
        _beard(figure, canvas)
    if figure.chance(0.10):
        canvas.paint(
            (np.abs(canvas.v - eye_level) < 0.09) & (np.abs(canvas.u - 0.5) < 0.3), figure.palette.accent
        )
    _eyes(figure, canvas, eye_level)
    _mouth(figure, canvas, eye_level - figure.between(0.22, 0.3))
    if figure.chance(0.08):
        x, y = canvas.local(0.44, eye_level)
        canvas.paint(
            (np.abs(x - 0.4 * y) < 0.02 * figure.build.head) & (np.abs(y) < 0.16 * figure.build.head),
            (0.7, 0.3, 0.3),
        )
    if figure.chance(0.06):
        radius = 0.22 * figure.build.head_width
        canvas.ellipse(0.5 + 0.4 * figure.build.head_width / canvas.width_m, eye_level, radius, radius, BLACK)
        x, y = canvas.local(0.5, eye_level)
        canvas.paint(np.abs(y - 0.25 * x) < 0.02 * figure.build.head, BLACK)


def _robot_face(figure: Figure, canvas: Canvas) -> None:
    glow, dark = figure.palette.accent, np.array((0.10, 0.11, 0.14))
    level, half = figure.between(0.42, 0.62), figure.build.head_width
    style = figure.choose("visor", "screen", "lamps", "slit")
    if style in ("visor", "screen"):
        tall = 0.13 if style == "visor" else 0.26
        canvas.paint((np.abs(canvas.v - level) < tall) & (np.abs(canvas.u - 0.5) < 0.14), dark)
    if style == "slit":
        canvas.rectangle(0.5, level, 0.8 * half, 0.08 * half, glow)
        return
    apart, size = 0.38 * half, half * figure.between(0.12, 0.2)
    for side in (-1.0, 1.0):
        u = 0.5 + side * apart / canvas.width_m
        if style == "lamps":
            canvas.ellipse(u, level, 1.4 * size, 1.4 * size, dark)
        canvas.ellipse(u, level, size, size * figure.between(0.7, 1.2), glow)
    if style != "visor":
        canvas.paint(
            (np.abs(canvas.v - level + 0.2) < 0.05)
            & (np.abs(canvas.u - 0.5) < 0.07)
            & ((canvas.u * 60) % 1 < 0.5),
            dark,
        )


def _skull_face(figure: Figure, canvas: Canvas) -> None:
    half, dark = figure.build.head_width, np.array((0.12, 0.10, 0.09))
    for side in (-1.0, 1.0):
        u = 0.5 + side * 0.42 * half / canvas.width_m
        canvas.ellipse(u, 0.46, 0.27 * half, 0.27 * half, dark)
        if figure.chance(0.5):
            canvas.ellipse(u, 0.46, 0.1 * half, 0.1 * half, figure.palette.accent)
    canvas.ellipse(0.5, 0.31, 0.1 * half, 0.14 * half, dark)
    x, y = canvas.local(0.5, 0.14)
    teeth = (np.abs(x) < 0.5 * half) & (np.abs(y) < 0.12 * half)
    canvas.paint(teeth & (((x / half * 6.0) % 1.0 < 0.2) | (np.abs(y) < 0.02 * half)), dark)


def make_head(figure: Figure, head: Head, hair: Colour | None, hairline: float) -> list[Part]:
    """The head with its painted face; painted hair where the hair is (None: bald)."""
    build = figure.build
    canvas = Canvas(
        head.face_width_m, build.head, figure.palette.skin, density=200.0 if build.head < 0.5 else 110.0
    )
    canvas.shade(1.0, figure.shade)
    if figure.surface in ("fur", "creature") and figure.chance(0.5):
        canvas.ellipse(
            0.5, 0.25, 0.6 * build.head_width, 0.3 * build.head, mix(figure.palette.skin, WHITE, 0.5)
        )
    if figure.surface == "robot":
        _robot_face(figure, canvas)
    elif figure.surface == "skeleton":
        _skull_face(figure, canvas)
    else:
        _human_face(figure, canvas)
    if hair is not None:
        away = np.abs(canvas.u - 0.5)
        line = np.where(away < 0.17, hairline, hairline - np.clip((away - 0.17) * 9.0, 0.0, 0.55))
        canvas.paint(canvas.v > line, hair)
    parts = [Part("head", head_shape(figure, head), canvas.image())]
    if figure.surface in ("human", "creature") and figure.chance(0.7):
        parts += _nose(figure, head)
    return parts


def _nose(figure: Figure, head: Head) -> list[Part]:
    centre, half = head.ring(figure, 0.33 if figure.build.name in ("chibi", "blob") else 0.42)
    size = figure.build.head_width * figure.between(0.09, 0.2)
    tip = centre - np.array((0.0, half[1], 0.0))
    colour = darker(figure.palette.skin, figure.between(0.82, 1.0))
    if figure.build.name == "blocky" or figure.chance(0.3):
        return [flat("nose", box(tip, (0.6 * size, 0.7 * size, size), taper=0.6), colour)]
    return [flat("nose", ball(tip, (0.7 * size, size, size), sides=8, rings=5), colour)]


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
        elif style == "bear" or style == "mouse":
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
    colour = (
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
                flat("horns", tube(root + long * 0.6 * steps * UP, np.full(5, 0.4 * thick), sides=6), colour)
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
            parts.append(flat("horns", loft(root + long * bend, radii, sides=7), colour))
    return parts
