"""Faces painted on heads."""

import numpy as np

from charnerf.procedural.figure import Figure
from charnerf.procedural.palette import BLACK, WHITE
from charnerf.procedural.textures import (
    Canvas,
    darker,
    mix,
)


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
    color = figure.palette.hair if figure.chance(0.6) else mix(figure.palette.skin, figure.palette.hair, 0.45)
    x, y = canvas.local(0.5, 0.0)
    x, y = np.abs(x) / figure.build.head_width, y / figure.build.head
    kind = figure.choose("full", "chin", "moustache", "stubble")
    if kind in ("full", "stubble"):
        mouth = (x < 0.25) & (np.abs(y - 0.22) < 0.03)
        canvas.paint(
            (y < 0.16 + 0.22 * np.clip(x, 0.0, 1.2)) & (x < 1.25) & ~mouth,
            color,
            1.0 if kind == "full" else 0.5,
        )
    if kind in ("chin",):
        canvas.paint((y < 0.14) & (x < 0.4), color)
    if kind in ("moustache", "full"):
        canvas.paint((np.abs(y - 0.28 + 0.1 * x) < 0.035) & (x < 0.45), color)


def paint_human_face(figure: Figure, canvas: Canvas) -> None:
    """Eyes, brows, mouth, and now and then a beard, mask, scar or eye patch."""
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


def paint_robot_face(figure: Figure, canvas: Canvas) -> None:
    """Lamps, a visor, a screen or a slit."""
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


def paint_skull_face(figure: Figure, canvas: Canvas) -> None:
    """Sockets, nose hole and teeth."""
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
