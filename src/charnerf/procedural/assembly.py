"""make_shape: a seed becomes a shape without meaning, in a character's frame and of about its proportions.

Half of them have a trunk, a head, arms and legs of any solids, in the poses that drawings have; the others are stacks and
clusters. What stands out of them is solids once more. A network that learns of these can not answer with the characters
that it knows.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from charnerf.geometry.stances import arm_directions, draw_stance, leg_direction
from charnerf.geometry.world import HEIGHT
from charnerf.procedural.booleans import united
from charnerf.procedural.palette import HAIRS, LEATHERS, METALS, NEUTRALS, SKINS, pick, vivid
from charnerf.procedural.shapes import FRONT, UP, Array, rotation, unit
from charnerf.procedural.solids import Rng, Solid, lump, make_solid, revolution, superellipsoid
from charnerf.procedural.textures import Color
from charnerf.surfaces.color import linear_from_srgb
from charnerf.surfaces.surface_mesh import SurfaceMaterial, SurfaceMesh

SHAPES_VERSION = 2  # raise it whenever the shapes of a seed change: caches are named after it
REACH = 1.2  # m: farthest to a side
_FIGURES, _STACKS = 0.5, 0.2  # shares of the shapes; the rest are clusters
_CUT = 0.35  # share of the shapes that pieces are cut out of


def make_shape(seed: int) -> SurfaceMesh:
    """A shape without meaning.

    Args:
        seed: Any non-negative integer; equal seeds give equal shapes.

    Returns:
        One closed surface in the world frame: 2 m tall, feet on z = 0, middle of its box on the z axis, within REACH.
    """
    rng = np.random.default_rng(seed)
    colors = make_colors(rng)
    kind = rng.random()
    make = _figure if kind < _FIGURES else _stack if kind < _FIGURES + _STACKS else _cluster
    solids = make(rng, colors)
    cutters = (
        [_cutter(rng, solids, colors) for _ in range(int(rng.integers(1, 4)))] if rng.random() < _CUT else []
    )
    whole = united(solids, cutters)
    return surface_of(whole, _standing(whole.vertices))


def make_colors(rng: Rng) -> list[Color]:
    """Three to six colours of clothes, metals, skins and hair."""
    tables = (NEUTRALS, METALS, LEATHERS, SKINS, HAIRS)
    return [
        vivid(rng, rng.random()) if rng.random() < 0.45 else pick(rng, tables[int(rng.integers(len(tables)))])
        for _ in range(int(rng.integers(3, 7)))
    ]


def make_piece(rng: Rng, colors: list[Color], centre: ArrayLike, half: ArrayLike) -> SurfaceMesh:
    """One solid of any kind, nearly upright.

    Args:
        rng: What is drawn from.
        colors: From `make_colors`.
        centre: World frame, (3,), m.
        half: Half of its sizes, (3,), m.
    """
    solid = _upright(rng, colors, centre, half)
    return surface_of(solid, solid.vertices)


def surface_of(solid: Solid, vertices: Array) -> SurfaceMesh:
    """The surface of a solid whose vertices stand at given places (n, 3)."""
    count = len(solid.faces)
    colors = np.ones((count, 3, 4), np.float32)
    colors[..., :3] = linear_from_srgb(solid.colors)[solid.faces]
    return SurfaceMesh(
        triangles=vertices[solid.faces].astype(np.float32),
        uvs=np.zeros((count, 3, 2), np.float32),
        colors=colors,
        material_ids=np.zeros(count, np.int32),
        materials=(SurfaceMaterial(factor=np.ones(4, np.float32)),),
    )


def _standing(vertices: Array) -> Array:
    """Vertices brought to the world's height and within REACH, on z = 0 and in the middle."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    middle = np.array((0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]))
    scale = np.minimum(HEIGHT / size[2], 2.0 * REACH / size)
    scale[2] = HEIGHT / size[2]
    return (vertices - middle) * scale


def _figure(rng: Rng, colors: list[Color]) -> list[Solid]:
    """Trunk, head, arms and legs, or a base, of any solids; from slim to chunky, in a pose of drawings."""
    stance, stout = draw_stance(rng), float(np.exp(rng.normal(0.0, 0.35)))
    hips, trunk, head = rng.uniform((0.3, 0.5, 0.2), (1.0, 0.9, 0.6))
    wide, deep = np.array((0.2, 0.15)) * stout * np.exp(rng.normal(0.0, 0.2, 2))
    shoulders, top = hips + trunk, hips + trunk + 0.5 * head
    turn = rotation(UP, stance.twist) @ rotation(FRONT, -stance.lean)
    solids = [
        _upright(rng, colors, (0.0, 0.0, hips + 0.45 * trunk), (wide, deep, 0.58 * trunk)),
        _upright(
            rng, colors, (0.0, 0.0, top), np.array((0.5, 0.5, 0.55)) * head * rng.uniform(0.75, 1.25, 3)
        ),
        _along(rng, colors, (0.0, 0.0, shoulders - 0.1), (0.0, 0.0, top), (0.3 * wide, 0.3 * wide)),
    ]
    length, thick = rng.uniform(0.45, 0.8), 0.07 * stout * float(rng.uniform(0.7, 1.6))
    for side, arm in zip((1.0, -1.0), stance.arms, strict=True):
        joint = np.array((side * 0.9 * wide, 0.0, shoulders - 1.2 * thick))
        upper, lower = arm_directions(arm, side)
        elbow = joint + 0.5 * length * upper
        solids += _limb(rng, colors, [joint, elbow, elbow + 0.5 * length * lower], thick)
    solids = [solid.placed(turn, (0.0, 0.0, 0.0)) for solid in solids]
    if rng.random() < 0.2:
        base = _upright(rng, colors, (0.0, 0.0, 0.55 * hips), (1.1 * wide, 1.1 * deep, 0.55 * hips))
        return [*solids, base, *_worn(rng, colors, [*solids, base])]
    thick *= float(rng.uniform(1.0, 1.6))
    for side, leg in zip((1.0, -1.0), stance.legs, strict=True):
        joint = np.array((side * max(0.5 * wide, thick), 0.0, hips + 0.05))
        foot = joint + hips * leg_direction(leg, side)
        solids += _limb(rng, colors, [joint, 0.5 * (joint + foot), foot], thick)
    return solids + _worn(rng, colors, solids)


def _limb(rng: Rng, colors: list[Color], joints: list[Array], thick: float) -> list[Solid]:
    """Two bones and what is at the end of them."""
    solids = [
        _along(rng, colors, start, end, thick * rng.uniform(0.7, 1.3, 2)) for start, end in pairwise(joints)
    ]
    return [*solids, _upright(rng, colors, joints[-1], thick * rng.uniform(0.9, 1.9, 3))]


def _stack(rng: Rng, colors: list[Color]) -> list[Solid]:
    """Some solids on top of each other."""
    heights = rng.uniform(0.3, 1.0, int(rng.integers(2, 6)))
    tops = 2.0 * np.cumsum(heights) / heights.sum()
    solids = [
        _upright(rng, colors, (0.0, 0.0, top - half), (*rng.uniform(0.15, 0.6, 2), 1.15 * half))
        for top, half in zip(tops, heights / heights.sum(), strict=True)
    ]
    return solids + _worn(rng, colors, solids)


def _cluster(rng: Rng, colors: list[Color]) -> list[Solid]:
    """Solids that grow out of each other, most on both sides alike."""
    solids = [_upright(rng, colors, (0.0, 0.0, 1.0), rng.uniform(0.15, 0.5, 3))]
    even = rng.random() < 0.7
    for _ in range(int(rng.integers(3, 9))):
        solid = _grown(rng, colors, solids, float(rng.uniform(0.12, 0.45)))
        solids += [solid, solid.mirrored()] if even else [solid]
    return solids


def _worn(rng: Rng, colors: list[Color], solids: list[Solid]) -> list[Solid]:
    """None to six smaller solids that stand out of others, most on both sides alike."""
    worn: list[Solid] = []
    for _ in range(int(rng.integers(0, 7))):
        solid = _grown(rng, colors, solids, float(rng.uniform(0.06, 0.25)))
        worn += [solid, solid.mirrored()] if rng.random() < 0.6 else [solid]
    return worn


def _grown(rng: Rng, colors: list[Color], solids: list[Solid], size: float) -> Solid:
    """A solid of about a size, m, on the surface of one of the others."""
    vertices = solids[int(rng.integers(len(solids)))].vertices
    at = vertices[int(rng.integers(len(vertices)))]
    half = size * np.exp(rng.normal(0.0, 0.4, 3))
    turn = _random_turn(rng) if rng.random() < 0.4 else np.eye(3)
    return make_solid(rng, colors).placed(turn @ np.diag(half), at)


def _cutter(rng: Rng, solids: list[Solid], colors: list[Color]) -> Solid:
    """What is cut out of a shape, from the side of one of its solids."""
    return _grown(rng, colors, solids, float(rng.uniform(0.08, 0.3)))


def _upright(rng: Rng, colors: list[Color], centre: ArrayLike, half: ArrayLike) -> Solid:
    """Any solid with a centre and half sizes, m, turned a little."""
    turn = np.linalg.qr(np.eye(3) + rng.normal(0.0, 0.06, (3, 3)))[0]
    return make_solid(rng, colors).placed(turn * np.sign(np.diag(turn)) @ np.diag(np.asarray(half)), centre)


def _along(rng: Rng, colors: list[Color], start: ArrayLike, end: ArrayLike, half: ArrayLike) -> Solid:
    """A limb-like solid from a place to another, with half widths across."""
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    way = last - first
    along = unit(way)
    across = unit(np.cross(along, FRONT + 1e-3 * UP))
    frame = np.stack((across, np.cross(along, across), along), axis=-1)
    solid = make_solid(rng, colors, (superellipsoid, revolution, lump)[int(rng.integers(3))])
    return solid.placed(frame @ np.diag((*np.asarray(half), 0.6 * np.linalg.norm(way))), 0.5 * (first + last))


def _random_turn(rng: Rng) -> Array:
    """A rotation (3, 3), all of them alike likely."""
    turn, triangle = np.linalg.qr(rng.normal(size=(3, 3)))
    turn = turn * np.sign(np.diag(triangle))
    return turn * np.sign(np.linalg.det(turn))
