"""Random closed solids in a cube of side 2, coloured at their vertices: what shapes without meaning are assembled of.

Superellipsoids (Barr, Superquadrics and Angle-Preserving Transformations, 1981), surfaces of revolution, swept curves,
star-shaped lumps and reliefs (heights on both sides of a plate), each tapered, twisted and bent at random.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from charnerf.procedural.shapes import UP, Array, Shape, ball, loft, sheet
from charnerf.procedural.textures import Color

Rng = np.random.Generator
_RINGS, _SIDES = 18, 28


@dataclass(frozen=True)
class Solid:
    """A closed surface: vertices (n, 3), faces (f, 3) turned outwards, sRGB colours of the vertices (n, 3)."""

    vertices: Array
    faces: NDArray[np.int64]
    colors: Array

    def placed(self, linear: ArrayLike, offset: ArrayLike) -> "Solid":
        """Apply a linear map (3, 3) of positive determinant, then an offset (3,)."""
        return Solid(self.vertices @ np.asarray(linear).T + np.asarray(offset), self.faces, self.colors)

    def mirrored(self) -> "Solid":
        """The mirror image in the plane x = 0."""
        return Solid(self.vertices * np.array((-1.0, 1.0, 1.0)), self.faces[:, ::-1], self.colors)


def make_solid(rng: Rng, colors: list[Color], make: Callable[[Rng], Shape] | None = None) -> Solid:
    """A solid that fills the cube from -1 to 1.

    Args:
        rng: What is drawn from.
        colors: Those that it is painted with, sRGB.
        make: One of KINDS; None for any.
    """
    shape = (KINDS[int(rng.integers(len(KINDS)))] if make is None else make)(rng)
    vertices = _filled(_bent(rng, _filled(shape.vertices)))
    return Solid(vertices, shape.faces, _painted(rng, vertices, colors))


def superellipsoid(rng: Rng) -> Shape:
    """From boxes over cylinders and balls to octahedra."""
    upright, level = np.exp(rng.uniform(np.log(0.15), np.log(2.2), 2))
    angle = np.pi * (np.arange(_RINGS) + 0.5) / _RINGS
    heights = -np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** upright
    tip = 1.0 - float(heights[-1])
    widths = np.sin(angle) ** upright
    return loft(np.outer(heights, UP), widths, axis=UP, sides=_SIDES, power=2.0 / level, bulge=(tip, tip))


def revolution(rng: Rng) -> Shape:
    """A smooth profile turned about the vertical; at times a prism."""
    knots = np.sort(rng.uniform(-1.0, 1.0, int(rng.integers(2, 6))))
    radii = PchipInterpolator(
        np.concatenate(([-1.0], knots + 1e-3 * np.arange(len(knots)), [1.1])),
        rng.uniform(0.2, 1.0, len(knots) + 2),
    )
    heights = np.linspace(-1.0, 1.0, _RINGS)
    sides = _SIDES if rng.random() < 0.8 else int(rng.integers(5, 9))
    return loft(np.outer(heights, UP), radii(heights), axis=UP, sides=sides)


def swept(rng: Rng) -> Shape:
    """A limb, horn or tail: a bent path with its own radius at every place."""
    along = np.linspace(-1.0, 1.0, _RINGS)
    sway = rng.normal(0.0, 0.5, (2, 2))
    path = np.stack((*(a * along**2 + b * along**3 for a, b in sway), 2.0 * along), axis=-1)
    radii = PchipInterpolator((-1.0, -0.3, 0.4, 1.0), rng.uniform(0.15, 0.5, 4))(along)
    return loft(path, radii, sides=16, power=float(rng.uniform(1.6, 4.0)), bulge=(0.1, 0.1))


def lump(rng: Rng) -> Shape:
    """A ball with waves on it."""
    shape = ball((0.0, 0.0, 0.0), 1.0, sides=_SIDES, rings=_RINGS)
    waves = rng.normal(0.0, 2.2, (6, 3))
    heights = np.sin(shape.vertices @ waves.T + rng.uniform(0.0, 6.3, 6)) @ rng.normal(0.0, 0.12, 6)
    return Shape(shape.vertices * np.maximum(1.0 + heights, 0.3)[:, None], shape.faces, shape.uv)


def relief(rng: Rng) -> Shape:
    """A plate with heights on both of its sides, along y."""
    x, z = np.meshgrid(np.linspace(-1.0, 1.0, 22), np.linspace(-1.0, 1.0, 22))
    waves = rng.normal(0.0, 2.5, (2, 4, 2))
    phases = rng.uniform(0.0, 6.3, (2, 4))
    middle, thickness = np.sin(
        np.einsum("kwc,mnc->kmnw", waves, np.stack((x, z), axis=-1)) + phases[:, None, None]
    ).mean(-1)
    grid = np.stack((x, 0.3 * middle, z), axis=-1)
    return sheet(grid, (0.35 + 0.25 * thickness)[..., None])


KINDS = (superellipsoid, superellipsoid, revolution, swept, lump, relief)


def _filled(vertices: Array) -> Array:
    """Vertices moved and scaled, by axes, to fill the cube."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return (2.0 * vertices - low - high) / np.maximum(high - low, 1e-9)


def _bent(rng: Rng, vertices: Array) -> Array:
    """Vertices tapered, twisted about the vertical and bent; each in some cases."""
    x, y, z = vertices.T
    taper, twist, bend = rng.normal(0.0, (0.3, 0.4, 0.3)) * (rng.random(3) < (0.5, 0.3, 0.3))
    widths = np.exp(np.clip(taper, -0.7, 0.7) * z)
    x, y = widths * x, widths * y
    x, y = np.cos(twist * z) * x - np.sin(twist * z) * y, np.sin(twist * z) * x + np.cos(twist * z) * y
    return np.stack((x + bend * z**2, y, z), axis=-1)


def _painted(rng: Rng, vertices: Array, colors: list[Color]) -> Array:
    """Colours of vertices: plain, banded, checked, spotted or blended from one to another."""
    first, second = (np.asarray(colors[int(index)]) for index in rng.integers(len(colors), size=2))
    axis, waves = rng.normal(size=3), rng.uniform(1.5, 6.0, 3)
    along = vertices @ (axis / np.linalg.norm(axis))
    kind = rng.choice(5, p=(0.4, 0.2, 0.1, 0.15, 0.15))
    share = (
        np.zeros(len(vertices)),
        np.sin(waves[0] * along) > 0.3,
        np.sin(waves * vertices).prod(axis=-1) > 0.0,
        np.sin(waves * vertices + axis).sum(axis=-1) > 1.2,
        0.5 + 0.5 * np.clip(along, -1.0, 1.0),
    )[kind].astype(np.float64)
    return first + share[:, None] * (second - first)
