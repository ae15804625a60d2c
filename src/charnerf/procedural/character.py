"""make_character: a seed becomes a humanoid character."""

import numpy as np
import trimesh

from charnerf.procedural import armour, backs, body, clothing, props
from charnerf.procedural.ears import make_ears, make_horns
from charnerf.procedural.figure import Figure, make_figure
from charnerf.procedural.hair import make_beard, make_hair
from charnerf.procedural.hats import make_hat
from charnerf.procedural.head import make_head, make_head_form
from charnerf.procedural.outfit import Outfit, make_outfit
from charnerf.procedural.parts import Part, assemble, pixelated, to_world
from charnerf.procedural.voxels import make_voxel_parts

GENERATOR_VERSION = 2  # raise it whenever the characters of a seed change: caches are named after it
VOXEL_SHARE = 0.09


def _head(figure: Figure) -> list[Part]:
    """Head, hair, ears, hat and horns."""
    head = make_head_form(figure)
    hat, covering = make_hat(figure, head) if figure.chance(0.36) else ([], False)
    hair = make_hair(figure, head)
    parts = make_head(
        figure, head, None if hair.hairline is None else figure.palette.hair, hair.hairline or 0.0
    )
    parts += hat
    if not covering or figure.chance(0.35):
        parts += hair.parts
    if figure.surface in ("human", "creature", "fur") and figure.chance(0.8 if not covering else 0.4):
        parts += make_ears(figure, head)
    if not hat and figure.chance({"creature": 0.5, "robot": 0.4, "skeleton": 0.15}.get(figure.surface, 0.03)):
        parts += make_horns(figure, head)
    if not figure.build.feminine and figure.surface in ("human", "creature") and figure.chance(0.14):
        parts += make_beard(figure, head)
    return parts


def _worn(figure: Figure, outfit: Outfit) -> list[Part]:
    """Modelled clothes, armour and carried things."""
    fighter = figure.chance(0.35)
    plain = figure.build.name == "realistic" and not fighter
    calm = 0.35 if plain else 1.0
    parts: list[Part] = []
    if figure.chance(0.35 if not plain else 0.15):
        parts += clothing.make_belt(figure)
    if figure.chance((0.4 if figure.build.feminine else 0.16) * (0.6 if plain else 1.0)):
        parts += clothing.make_skirt(figure, outfit)
    elif figure.chance(0.16 * calm):
        parts += clothing.make_tabard(figure)
    if figure.chance(0.14 * calm + 0.12 * fighter):
        parts += clothing.make_cape(figure)
    elif figure.chance(0.16 * calm):
        parts += backs.make_backpack(figure)
    if figure.chance(0.14 * calm):
        parts += clothing.make_scarf(figure)
    if figure.chance(0.35 * calm) and not outfit.barefoot:
        parts += armour.make_boots(figure)
    return parts + _gear(figure, calm, fighter)


def _gear(figure: Figure, calm: float, fighter: bool) -> list[Part]:
    """Armour, things held, tails and wings; calm scales how likely most are."""
    parts: list[Part] = []
    if figure.chance(0.2 * calm + 0.25 * fighter):
        parts += armour.make_bracers(figure)
    if figure.chance(0.06 * calm + 0.4 * fighter):
        parts += armour.make_pauldrons(figure)
    if figure.chance(0.05 * calm + 0.4 * fighter):
        parts += armour.make_breastplate(figure)
    if figure.chance(0.08 * calm + 0.35 * fighter):
        parts += props.make_held(figure)
    if figure.chance({"fur": 0.7, "creature": 0.35}.get(figure.surface, 0.02)):
        parts += backs.make_tail(figure)
    if figure.chance({"creature": 0.15, "robot": 0.06}.get(figure.surface, 0.03)):
        parts += backs.make_wings(figure)
    if figure.chance(0.015 * calm):
        parts += backs.make_flag(figure)
    return parts


def _humanoid(figure: Figure) -> list[Part]:
    """Everything but cubes."""
    outfit = make_outfit(figure)
    ribs = figure.surface == "skeleton" and outfit.bare_trunk
    trunk = (
        armour.make_ribs(figure) if ribs else [Part("trunk", body.trunk_shape(figure), outfit.trunk.image())]
    )
    loose = figure.between(0.0, 0.7) if figure.chance(0.3) else 0.0
    feet = figure.palette.skin if outfit.barefoot else figure.palette.boots
    parts = [
        *trunk,
        *body.make_arms(figure, outfit.arms),
        *body.make_hands(figure, outfit.hand),
        *body.make_legs(figure, outfit.legs, loose),
        *body.make_feet(figure, feet, bare=outfit.barefoot),
        *body.make_neck(figure, figure.palette.skin),
        *_head(figure),
        *_worn(figure, outfit),
    ]
    if figure.surface == "robot" and figure.chance(0.7):
        parts += armour.make_robot_joints(figure)
    return parts


def make_parts(seed: int) -> list[Part]:
    """The closed parts of a character in the world frame; equal seeds give equal parts.

    Args:
        seed: Any non-negative integer.

    Returns:
        Parts, 2 m tall together, feet on z = 0, facing -Y.
    """
    rng = np.random.default_rng(seed)
    if rng.uniform() < VOXEL_SHARE:
        return to_world(make_voxel_parts(rng))
    figure = make_figure(rng)
    parts = _humanoid(figure)
    if figure.build.name == "blocky" and figure.chance(0.5):
        cell = int(rng.integers(4, 9))
        parts = [pixelated(part, cell) for part in parts]
    return to_world(parts)


def make_character(seed: int) -> trimesh.Scene:
    """A humanoid game character.

    Args:
        seed: Any non-negative integer; equal seeds give equal characters.

    Returns:
        A scene in the world frame (metres, +Z up, facing -Y, 2 m tall, feet on z = 0, bounding box
        centred on the z axis): named geometries made of closed parts, sharing one material with an sRGB
        base-colour texture.
    """
    return assemble(make_parts(seed))
