"""Colours (sRGB in [0, 1]) that fit together."""

import colorsys
from dataclasses import dataclass

import numpy as np

from charnerf.procedural.textures import Color, mix

SKINS = (
    (0.98, 0.82, 0.70),
    (0.95, 0.76, 0.60),
    (0.88, 0.66, 0.48),
    (0.75, 0.53, 0.37),
    (0.58, 0.39, 0.26),
    (0.40, 0.27, 0.19),
    (0.30, 0.20, 0.15),
    (0.99, 0.88, 0.78),
    (0.93, 0.71, 0.55),
    (0.82, 0.60, 0.44),
)
CREATURES = (
    (0.48, 0.66, 0.34),
    (0.36, 0.52, 0.30),
    (0.55, 0.70, 0.72),
    (0.48, 0.42, 0.66),
    (0.70, 0.22, 0.20),
    (0.68, 0.72, 0.62),
    (0.36, 0.48, 0.72),
    (0.85, 0.62, 0.76),
    (0.56, 0.60, 0.64),
    (0.92, 0.80, 0.42),
)
FURS = (
    (0.72, 0.50, 0.28),
    (0.42, 0.28, 0.18),
    (0.88, 0.84, 0.78),
    (0.52, 0.52, 0.54),
    (0.20, 0.18, 0.18),
    (0.90, 0.58, 0.24),
    (0.68, 0.73, 0.68),
    (0.60, 0.36, 0.30),
)
METALS = (
    (0.62, 0.64, 0.68),
    (0.44, 0.46, 0.50),
    (0.30, 0.32, 0.36),
    (0.80, 0.66, 0.30),
    (0.66, 0.42, 0.26),
    (0.84, 0.86, 0.88),
    (0.22, 0.22, 0.25),
)
BONES = ((0.92, 0.88, 0.78), (0.80, 0.72, 0.58), (0.86, 0.86, 0.84))
HAIRS = (
    (0.10, 0.08, 0.07),
    (0.20, 0.13, 0.09),
    (0.36, 0.22, 0.12),
    (0.54, 0.36, 0.18),
    (0.80, 0.62, 0.32),
    (0.92, 0.80, 0.52),
    (0.66, 0.26, 0.12),
    (0.86, 0.42, 0.14),
    (0.60, 0.60, 0.60),
    (0.92, 0.92, 0.90),
)
LEATHERS = (
    (0.36, 0.24, 0.15),
    (0.24, 0.16, 0.11),
    (0.50, 0.34, 0.20),
    (0.16, 0.14, 0.14),
    (0.62, 0.46, 0.28),
    (0.30, 0.28, 0.28),
)
NEUTRALS = (
    (0.12, 0.12, 0.14),
    (0.22, 0.23, 0.26),
    (0.36, 0.37, 0.40),
    (0.55, 0.55, 0.56),
    (0.78, 0.77, 0.74),
    (0.94, 0.93, 0.91),
    (0.14, 0.18, 0.28),
    (0.26, 0.34, 0.48),
    (0.48, 0.42, 0.34),
    (0.33, 0.36, 0.26),
)
WHITE = np.array((0.96, 0.96, 0.96))
BLACK = np.array((0.06, 0.06, 0.07))


@dataclass(frozen=True)
class Palette:
    """The colours of one character: skin and what it wears."""

    skin: Color
    hair: Color
    eyes: Color
    main: Color
    second: Color
    accent: Color
    trousers: Color
    leather: Color
    boots: Color
    metal: Color


def pick(
    rng: np.random.Generator, colors: tuple[tuple[float, float, float], ...], spread: float = 0.04
) -> Color:
    """One of the colours, a little changed."""
    color = np.array(colors[int(rng.integers(len(colors)))])
    return np.clip(color * rng.uniform(0.9, 1.08) + rng.uniform(-spread, spread, 3), 0.02, 0.98)


def vivid(rng: np.random.Generator, hue: float, saturation: tuple[float, float] = (0.45, 0.95)) -> Color:
    """A strong colour of a hue in [0, 1)."""
    return np.array(colorsys.hsv_to_rgb(hue % 1.0, rng.uniform(*saturation), rng.uniform(0.35, 0.95)))


def _cloth(rng: np.random.Generator, hue: float) -> Color:
    kind = rng.uniform()
    if kind < 0.3:
        return pick(rng, NEUTRALS)
    if kind < 0.6:
        return vivid(rng, hue, (0.25, 0.55))
    return vivid(rng, hue)


def make_palette(rng: np.random.Generator, surface: str) -> Palette:
    """Colours for a character whose body is of a surface: human, creature, fur, robot or skeleton."""
    hue = rng.uniform()
    bodies = {"human": SKINS, "creature": CREATURES, "fur": FURS, "robot": METALS, "skeleton": BONES}
    skin = pick(rng, bodies[surface])
    if surface == "robot" and rng.uniform() < 0.6:
        skin = mix(skin, vivid(rng, rng.uniform()), 0.7)
    if surface == "creature" and rng.uniform() < 0.3:
        skin = vivid(rng, rng.uniform(), (0.3, 0.7))
    hair = vivid(rng, rng.uniform()) if rng.uniform() < 0.22 else pick(rng, HAIRS)
    step = rng.choice((0.08, 0.33, 0.5, 0.58))
    trousers = pick(rng, NEUTRALS) if rng.uniform() < 0.6 else _cloth(rng, hue + rng.uniform(-0.1, 0.1))
    leather = pick(rng, LEATHERS)
    main, second = _cloth(rng, hue), _cloth(rng, hue + step)
    if rng.uniform() < 0.2:
        trousers = np.clip(main * rng.uniform(0.6, 1.15), 0.0, 1.0)  # suits, uniforms, overalls
    if rng.uniform() < 0.12:
        second = np.clip(main * rng.uniform(0.6, 1.3), 0.0, 1.0)
    return Palette(
        skin=skin,
        hair=hair,
        eyes=vivid(rng, rng.uniform(), (0.3, 0.8)) if rng.uniform() < 0.5 else np.array((0.12, 0.10, 0.10)),
        main=main,
        second=second,
        accent=vivid(rng, hue + rng.choice((0.15, 0.5, 0.6)))
        if rng.uniform() < 0.7
        else np.array((0.85, 0.68, 0.26)),
        trousers=trousers,
        leather=leather,
        boots=leather if rng.uniform() < 0.6 else _cloth(rng, hue + step),
        metal=pick(rng, METALS),
    )
