"""Heads: their form, and how faces, hair colour and noses sit on them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from charnerf.procedural.faces import paint_human_face, paint_robot_face, paint_skull_face
from charnerf.procedural.figure import Figure
from charnerf.procedural.palette import WHITE
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import (
    UP,
    Array,
    Shape,
    ball,
    box,
    loft,
)
from charnerf.procedural.textures import (
    Canvas,
    Color,
    darker,
    mix,
)

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
    """The form of a head: relative widths at LEVELS, and its cross-section.

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
        """A closed shape around the head: how far it reaches at each level, in half sizes of the head.

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
        "realistic": ("egg", "jaw"),
        "stylised": ("egg", "round", "jaw", "bucket"),
        "chunky": ("jaw", "bucket", "block", "round"),
        "chibi": ("cheeks", "round", "bucket", "block"),
        "giant": ("jaw", "bucket", "round"),
        "blob": ("bucket", "cheeks", "round"),
        "blocky": ("block",),
    }[build.name]
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
        [centre for centre, _ in rings],
        [half for _, half in rings],
        axis=UP,
        sides=head.sides,
        power=head.power,
        bulge=bulge,
        along=LEVELS,
    )


def make_head(figure: Figure, head: Head, hair: Color | None, hairline: float) -> list[Part]:
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
        paint_robot_face(figure, canvas)
    elif figure.surface == "skeleton":
        paint_skull_face(figure, canvas)
    else:
        paint_human_face(figure, canvas)
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
    color = darker(figure.palette.skin, figure.between(0.82, 1.0))
    if figure.build.name == "blocky" or figure.chance(0.3):
        return [flat("nose", box(tip, (0.6 * size, 0.7 * size, size), taper=0.6), color)]
    return [flat("nose", ball(tip, (0.7 * size, size, size), sides=8, rings=5), color)]
