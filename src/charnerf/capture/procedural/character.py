"""make_character: a seed becomes a humanoid character."""

import numpy as np
import trimesh

from charnerf.capture.procedural import body
from charnerf.capture.procedural.figure import Figure, make_figure
from charnerf.capture.procedural.head import make_ears, make_head, make_head_form
from charnerf.capture.procedural.parts import Part, assemble, to_world
from charnerf.capture.procedural.textures import add_emblem, add_pattern


def _dressed(figure: Figure) -> list[Part]:
    palette = figure.palette
    trunk = body.trunk_canvas(figure, palette.main)
    if figure.chance(0.5):
        add_pattern(trunk, figure.rng, palette.second)
    trunk.band(0.0, 0.2, palette.trousers)
    trunk.band(0.17, 0.22, palette.leather)
    add_emblem(trunk, 0.5, 0.65, 0.08, int(figure.rng.integers(12)), palette.accent)
    arm = body.limb_canvas(figure, palette.skin, leg=False)
    arm.band(0.0, figure.between(0.2, 1.0), palette.main)
    leg = body.limb_canvas(figure, palette.trousers, leg=True)
    head = make_head_form(figure)
    return [
        Part("trunk", body.trunk_shape(figure), trunk.image()),
        *body.make_arms(figure, (arm, arm)),
        *body.make_hands(figure, palette.skin),
        *body.make_legs(figure, (leg, leg), 0.0),
        *body.make_feet(figure, palette.boots, bare=False),
        *body.make_neck(figure, palette.skin),
        *make_head(figure, head, palette.hair, 0.75),
        *make_ears(figure, head),
    ]


def make_parts(seed: int) -> list[Part]:
    """The closed parts of a character in the world frame; equal seeds give equal parts.

    Args:
        seed: Any non-negative integer.

    Returns:
        Parts, 2 m tall together, feet on z = 0, facing -Y.
    """
    return to_world(_dressed(make_figure(np.random.default_rng(seed))))


def make_character(seed: int) -> trimesh.Scene:
    """A humanoid game character.

    Args:
        seed: Any non-negative integer; equal seeds give equal characters.

    Returns:
        A scene in the world frame (metres, +Z up, facing -Y, 2 m tall, feet on z = 0, bounding box centred on the z axis): named
        geometries made of closed parts, sharing one material with an sRGB base-colour texture.
    """
    return assemble(make_parts(seed))
