"""Characters of the kinds that are hard or wasteful to render, each from a few solids.

All stand in the world frame: metres, 2 m tall on z = 0, facing -Y.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
import trimesh

from benchmarks.untrained import untrained_like
from charnerf.bench.subjects import Pictured, Subject, captured, subject
from charnerf.models.charnerf import CharNeRF

Color = tuple[int, int, int]
SKIN, SHIRT, TROUSERS, STEEL, CLOTH = (
    (230, 180, 140),
    (40, 90, 190),
    (60, 60, 80),
    (190, 195, 205),
    (170, 40, 60),
)
WHITE = (255, 255, 255)


def _colored(mesh: trimesh.Trimesh, color: Color) -> trimesh.Trimesh:
    colors = np.tile(np.array([*color, 255], np.uint8), (len(mesh.vertices), 1))
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=colors)
    return mesh


def _limb(
    start: tuple[float, float, float], end: tuple[float, float, float], radius: float, color: Color
) -> trimesh.Trimesh:
    return _colored(trimesh.creation.cylinder(radius, segment=(start, end), sections=16), color)


def _ball(centre: tuple[float, float, float], radius: float, color: Color) -> trimesh.Trimesh:
    return _colored(trimesh.creation.icosphere(3, radius).apply_translation(centre), color)


def _plate(
    size: tuple[float, float, float], centre: tuple[float, float, float], turn: float, color: Color
) -> trimesh.Trimesh:
    plate = trimesh.creation.box(size)
    plate.apply_transform(trimesh.transformations.rotation_matrix(turn, (0, 0, 1)))
    return _colored(plate.apply_translation(centre), color)


def _body(skin: Color = SKIN, shirt: Color = SHIRT, trousers: Color = TROUSERS) -> list[trimesh.Trimesh]:
    return [
        _ball((0.0, 0.0, 1.78), 0.22, skin),
        _limb((0.0, 0.0, 0.85), (0.0, 0.0, 1.58), 0.22, shirt),
        _limb((-0.12, 0.0, 0.0), (-0.12, 0.0, 0.9), 0.1, trousers),
        _limb((0.12, 0.0, 0.0), (0.12, 0.0, 0.9), 0.1, trousers),
        _limb((-0.25, 0.0, 1.5), (-0.34, -0.05, 0.85), 0.07, skin),
        _limb((0.25, 0.0, 1.5), (0.34, -0.05, 0.85), 0.07, skin),
    ]


def compact() -> trimesh.Scene:
    """A body with its arms down: the hull fits it well."""
    return trimesh.Scene(_body())


def thin() -> trimesh.Scene:
    """A thin blade held out and strands of hair: little solid in much hull."""
    strands = [
        _limb(
            (0.2 * math.cos(a), 0.2 * math.sin(a), 1.82),
            (0.3 * math.cos(a), 0.3 * math.sin(a), 1.3),
            0.012,
            CLOTH,
        )
        for a in np.linspace(0.3, math.pi - 0.3, 9)
    ]
    blade = _plate((0.02, 1.1, 0.06), (0.4, -0.5, 0.95), 0.35, STEEL)
    return trimesh.Scene([*_body(), *strands, blade])


def wide() -> trimesh.Scene:
    """Wings and a cape: thin plates whose hull is wide and mostly empty."""
    wings = [_plate((0.9, 0.02, 0.8), (side * 0.62, 0.35, 1.3), side * 0.5, CLOTH) for side in (-1, 1)]
    cape = _plate((0.7, 0.02, 1.3), (0.0, 0.3, 0.85), 0.0, CLOTH)
    return trimesh.Scene([*_body(), *wings, cape])


def white_on_white() -> trimesh.Scene:
    """The body in the background's colour: nothing to see, all to evaluate."""
    return trimesh.Scene(_body(WHITE, WHITE, WHITE))


KINDS: dict[str, Callable[[], trimesh.Scene]] = {
    "compact body": compact,
    "thin blade and hair": thin,
    "wings and cape": wide,
    "white on white": white_on_white,
    "fog": compact,  # with an untrained field
    "empty picture": compact,  # with a camera that looks away
}


def subjects_by_kind(network: CharNeRF, *, size: int) -> list[Subject]:
    """One subject of each kind of scene; fog is what an untrained field of the same build answers."""
    fog = untrained_like(network)
    subjects = []
    for kind, build in KINDS.items():
        pictured = captured(kind, build(), size)
        if kind == "empty picture":
            pictured = _looking_away(pictured)
        used = fog if kind == "fog" else network
        subjects.append(subject(pictured, used))
    return subjects


def _looking_away(pictured: Pictured) -> Pictured:
    """The camera turned round: nothing is in its picture."""
    pose = pictured.camera.world_from_camera.clone()
    pose[:3, 0], pose[:3, 2] = -pose[:3, 0], -pose[:3, 2]
    return replace(
        pictured,
        camera=replace(pictured.camera, world_from_camera=pose),
        picture=torch.ones_like(pictured.picture),
    )
