"""What is painted on trunk, arms and legs: shirts, jackets, trousers, bare skin, panels."""

from dataclasses import dataclass

import numpy as np

from charnerf.procedural import body
from charnerf.procedural.figure import Figure
from charnerf.procedural.palette import BLACK, WHITE
from charnerf.procedural.textures import (
    NUM_EMBLEMS,
    Canvas,
    Color,
    add_emblem,
    add_pattern,
    darker,
    mix,
)


@dataclass(frozen=True)
class Outfit:
    """Painted canvases, and the colours of what is modelled on top."""

    trunk: Canvas
    arms: tuple[Canvas, Canvas]
    legs: tuple[Canvas, Canvas]
    top: Color
    hand: Color
    barefoot: bool
    bare_trunk: bool


def _finish(figure: Figure, canvas: Canvas) -> None:
    """Cloth grain and painted light."""
    if figure.grain:
        canvas.grain(figure.rng, figure.grain, 0.025)
    canvas.shade(1.0, figure.shade)


def _emblem(figure: Figure, canvas: Canvas, top: Color) -> None:
    half = figure.build.waist * figure.between(0.25, 0.6)
    at = (0.5, figure.between(0.6, 0.74))
    add_emblem(canvas, at, half, int(figure.rng.integers(NUM_EMBLEMS)), figure.palette.accent)


def _buttons(figure: Figure, canvas: Canvas, top: Color) -> None:
    canvas.strip(0.5, 0.006, darker(top, 0.75))
    for level in np.linspace(0.3, 0.88, int(figure.rng.integers(3, 6))):
        canvas.ellipse(0.5, level, 0.016, 0.016, figure.palette.accent)


def _jacket(figure: Figure, canvas: Canvas, top: Color) -> None:
    """An open jacket: wider towards the neck, at times with lapels and a tie."""
    inner = figure.palette.second if figure.chance(0.6) else WHITE
    opening = figure.between(0.03, 0.1) * (0.35 + 0.9 * np.clip(canvas.v - 0.1, 0.0, 1.0))
    aside = np.abs(canvas.u - 0.5)
    canvas.paint(aside < opening, inner)
    if figure.chance(0.5):
        above = canvas.v > 0.45 * figure.chance(0.5)
        canvas.paint((np.abs(aside - opening) < 0.014) & above, darker(top, figure.between(0.5, 1.35)))
    if figure.chance(0.3):
        canvas.strip(0.5, 0.012, figure.palette.accent, low=0.3, high=0.95)


def _tie(figure: Figure, canvas: Canvas, top: Color) -> None:
    canvas.paint(np.abs(canvas.u - 0.5) < 0.09 * np.clip(canvas.v - 0.5, 0.0, 1.0) * 2.0, WHITE)
    canvas.strip(0.5, 0.014, figure.palette.accent, low=0.45, high=0.96)


def _zip(figure: Figure, canvas: Canvas, top: Color) -> None:
    canvas.strip(0.5, 0.008, figure.palette.metal, low=0.2)
    canvas.band(0.9, 1.0, figure.palette.second)


def _sash(figure: Figure, canvas: Canvas, top: Color) -> None:
    """A sash from a shoulder to the other hip, around the back too."""
    slope = 1.0 if figure.chance(0.5) else -1.0
    wide = figure.between(0.03, 0.07)
    ahead = np.abs(canvas.u - 0.5)
    x, y = canvas.local(0.5, 0.6)
    canvas.paint((np.abs(y - slope * 1.1 * x) < wide) & (ahead < 0.25), figure.palette.accent)
    x, y = canvas.local(0.0, 0.6)
    canvas.paint((np.abs(y + slope * 1.1 * x) < wide) & (ahead > 0.25), figure.palette.accent)


def _bib(figure: Figure, canvas: Canvas, top: Color) -> None:
    """Dungarees."""
    canvas.paint((np.abs(canvas.u - 0.5) < 0.12) & (canvas.v < 0.72), figure.palette.trousers)
    for u in (0.39, 0.61):
        canvas.strip(u, 0.02, figure.palette.trousers, low=0.5)
        canvas.ellipse(u, 0.7, 0.02, 0.02, figure.palette.accent)


def _pockets(figure: Figure, canvas: Canvas, top: Color) -> None:
    for side in (-1.0, 1.0) if figure.chance(0.6) else (1.0,):
        canvas.rectangle(0.5 + side * 0.09, 0.68, 0.05, 0.04, darker(top, 0.8))


FRONTS = (
    _pockets, _emblem, _buttons, _jacket, _jacket, _tie, _zip, _sash, _bib, _emblem, _pockets,
)  # fmt: skip


def _back_of_trunk(figure: Figure, canvas: Canvas, top: Color) -> None:
    """Something of its own behind: an emblem, straps, a stripe, a yoke."""
    palette = figure.palette
    kind = figure.choose("plain", "plain", "emblem", "stripe", "straps", "yoke", "patch")
    behind = np.abs(canvas.u - 0.5) > 0.27
    if kind == "emblem":
        half = figure.build.waist * figure.between(0.4, 0.75)
        add_emblem(canvas, (0.0, 0.6), half, int(figure.rng.integers(NUM_EMBLEMS)), palette.accent)
    elif kind == "stripe":
        canvas.strip(0.0, figure.between(0.015, 0.06), palette.second, low=0.2)
    elif kind == "straps":
        x, y = canvas.local(0.0, 0.62)
        canvas.paint(behind & (np.abs(np.abs(x) - np.abs(y) * 0.7) < 0.025), palette.leather)
    elif kind == "yoke":
        canvas.paint(behind & (canvas.v > figure.between(0.6, 0.8)), darker(top, 0.75))
    elif kind == "patch":
        canvas.rectangle(0.02, figure.between(0.4, 0.7), 0.07, 0.06, palette.second)


def _skin_trunk(figure: Figure, canvas: Canvas) -> None:
    """Bare skin: chest, navel, belly, tattoos or fur markings."""
    dark, pale = darker(figure.palette.skin, 0.85), mix(figure.palette.skin, WHITE, 0.4)
    if figure.surface in ("fur", "creature"):
        if figure.chance(0.7):
            patch = pale if figure.chance(0.6) else figure.palette.accent
            canvas.ellipse(
                0.5, figure.between(0.3, 0.5), 0.7 * figure.build.waist, 0.3 * canvas.height_m, patch
            )
        if figure.chance(0.5):
            add_pattern(canvas, figure.rng, darker(figure.palette.skin, 0.75))
            if figure.chance(0.5):
                canvas.ellipse(0.5, 0.4, 0.6 * figure.build.waist, 0.28 * canvas.height_m, pale)
        return
    for side in (-1.0, 1.0):
        x, y = canvas.local(0.5 + 0.07 * side, 0.72)
        canvas.paint((np.abs(y + 0.04 - 0.8 * x**2 / 0.1) < 0.008) & (np.abs(x) < 0.07), dark)
    canvas.ellipse(0.5, 0.36, 0.012, 0.018, dark)
    if figure.chance(0.3):
        add_emblem(
            canvas,
            (0.42 if figure.chance(0.5) else 0.58, 0.7),
            0.08,
            int(figure.rng.integers(NUM_EMBLEMS)),
            dark,
        )


def _metal_trunk(figure: Figure, canvas: Canvas) -> None:
    """A robot's panels, vents and lamps."""
    palette = figure.palette
    line = darker(palette.skin, 0.6)
    for level in figure.rng.uniform(0.15, 0.9, 3):
        canvas.band(level, level + 0.02, line)
    for u in (0.3, 0.5, 0.7, 0.95):
        if figure.chance(0.5):
            canvas.strip(u, 0.006, line)
    if figure.chance(0.6):
        canvas.paint((np.abs(canvas.u - 0.5) < 0.11) & (np.abs(canvas.v - 0.68) < 0.14), palette.second)
    canvas.ellipse(0.5, 0.68, 0.07, 0.07, palette.accent)
    canvas.ellipse(0.5, 0.68, 0.04, 0.04, WHITE)
    vents = (
        (np.abs(canvas.u - 0.5) > 0.36) & (np.abs(canvas.v - 0.6) < 0.15) & ((canvas.v * 20.0) % 1.0 < 0.5)
    )
    canvas.paint(vents, BLACK)


def _paint_trunk(figure: Figure, top: Color, bare: bool) -> Canvas:
    palette = figure.palette
    canvas = body.trunk_canvas(figure, palette.skin if bare else top)
    if figure.surface == "robot" and bare:
        _metal_trunk(figure, canvas)
    elif bare:
        _skin_trunk(figure, canvas)
    else:
        if figure.chance(0.36):
            add_pattern(canvas, figure.rng, palette.second if figure.chance(0.6) else darker(top, 0.75))
        _back_of_trunk(figure, canvas, top)
        FRONTS[int(figure.rng.integers(len(FRONTS)))](figure, canvas, top)
        if figure.chance(0.6):
            depth = figure.between(0.04, 0.14) * canvas.height_m
            canvas.ellipse(0.5, 1.0, 0.4 * figure.build.waist, depth, palette.skin)
            canvas.paint((canvas.v > 0.965) & (np.abs(canvas.u - 0.5) < 0.25), palette.skin)
    if figure.surface not in ("fur",) or not bare or figure.chance(0.4):
        hem = figure.between(0.1, 0.24)
        canvas.band(0.0, hem, palette.trousers)
        if figure.chance(0.6):
            canvas.band(hem - 0.02, hem + 0.04, palette.leather)
            canvas.paint(
                (np.abs(canvas.v - hem - 0.01) < 0.03) & (np.abs(canvas.u - 0.5) < 0.02), palette.accent
            )
    _finish(figure, canvas)
    return canvas


def _paint_arms(figure: Figure, top: Color, bare: bool) -> tuple[Canvas, Canvas]:
    palette = figure.palette
    sleeve = 0.0 if bare else float(figure.rng.choice((0.12, 0.3, 0.42, 0.6, 1.01, 1.01, 1.01)))
    cuff = figure.chance(0.4)
    odd = figure.chance(0.15)
    cloth = palette.second if figure.chance(0.12) else top
    pattern = figure.chance(0.15)
    stripe, band, elbow = figure.chance(0.1), figure.chance(0.12), figure.chance(0.1)
    both = []
    for left in (True, False):
        canvas = body.limb_canvas(figure, palette.skin, leg=False)
        length = figure.between(0.0, 1.0) if odd and left else sleeve
        canvas.band(0.0, length, cloth)
        if pattern and sleeve > 0.3:
            painted = canvas.rgb.copy()
            add_pattern(canvas, figure.rng, palette.second)
            canvas.rgb = np.where((canvas.v < length)[..., None], canvas.rgb, painted)
        if cuff and length > 0.2:
            canvas.band(length - 0.09, length, palette.second)
        if stripe:
            canvas.strip(0.25 if left else 0.75, 0.05, palette.accent, high=length)
        if band and left:
            canvas.band(0.28, 0.36, palette.accent)
        if elbow and length > 0.6:
            canvas.band(0.44, 0.56, palette.leather)
        if figure.surface == "robot":
            for level in (0.22, 0.47, 0.53, 0.85):
                canvas.band(level, level + 0.03, darker(palette.skin, 0.5))
        _finish(figure, canvas)
        both.append(canvas)
    return both[0], both[1]


def _paint_legs(figure: Figure, bare: bool, barefoot: bool) -> tuple[Canvas, Canvas]:
    palette = figure.palette
    length = float(figure.rng.choice((0.3, 0.45, 0.7, 1.01, 1.01, 1.01, 1.01)))
    if bare and figure.surface in ("fur", "creature", "robot"):
        length = 0.0 if figure.chance(0.6) else 0.35
    boots = 1.1 if barefoot else float(figure.rng.choice((0.62, 0.75, 0.85, 1.1, 1.1)))
    stripe, knees, torn, pattern, odd = (figure.chance(p) for p in (0.14, 0.14, 0.08, 0.12, 0.06))
    colors = (palette.trousers, palette.second if odd else palette.trousers)
    both = []
    for left, color in zip((True, False), colors, strict=True):
        canvas = body.limb_canvas(figure, palette.skin, leg=True)
        canvas.band(0.0, length, color)
        if pattern and length > 0.5:
            painted = canvas.rgb.copy()
            add_pattern(canvas, figure.rng, darker(color, 0.7))
            canvas.rgb = np.where((canvas.v < length)[..., None], canvas.rgb, painted)
        if stripe:
            canvas.strip(0.75 if left else 0.25, 0.04, palette.accent, high=length)
        if knees:
            canvas.paint((np.abs(canvas.v - 0.5) < 0.1) & (np.abs(canvas.u - 0.5) < 0.2), palette.leather)
        if torn and left:
            canvas.ellipse(figure.between(0.4, 0.6), figure.between(0.3, 0.7), 0.03, 0.04, palette.skin)
        if figure.surface == "robot":
            for level in (0.2, 0.48, 0.85):
                canvas.band(level, level + 0.04, darker(palette.skin, 0.5))
        canvas.band(boots, 1.2, palette.boots)
        if boots < 1.0 and figure.surface != "robot":
            canvas.band(boots, boots + 0.04, darker(palette.boots, 0.75))
        _finish(figure, canvas)
        both.append(canvas)
    return both[0], both[1]


def make_outfit(figure: Figure) -> Outfit:
    """Paint a whole outfit."""
    palette = figure.palette
    bare_chance = {"human": 0.07, "creature": 0.55, "fur": 0.6, "robot": 0.85, "skeleton": 0.25}[
        figure.surface
    ]
    bare = figure.chance(bare_chance)
    top = palette.main
    barefoot = figure.chance(
        {"human": 0.04, "creature": 0.55, "fur": 0.7, "robot": 0.0, "skeleton": 0.5}[figure.surface]
    )
    gloves = figure.chance(0.25)
    hand = palette.leather if gloves else palette.skin
    if figure.surface == "robot":
        hand = palette.metal
    return Outfit(
        trunk=_paint_trunk(figure, top, bare),
        arms=_paint_arms(figure, top, bare),
        legs=_paint_legs(figure, bare, barefoot),
        top=top,
        hand=hand,
        barefoot=barefoot,
        bare_trunk=bare,
    )
