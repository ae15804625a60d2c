"""Drawings of a data set's characters: what somebody would have drawn of them, on paper."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from charnerf.capture.character import capture_sources
from charnerf.capture.poses import find_joints, random_pose, reposed
from charnerf.data.characters import Character
from charnerf.data.drawing_style import DrawingStyle, draw_pictures, random_style
from charnerf.errors import ConfigError, DataError
from charnerf.geometry.framing import SOURCE_AZIMUTHS
from charnerf.pictures import save_png, to_bytes
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.surfaces.surface_mesh import SurfaceMesh

PAPER = (252, 251, 247)


@dataclass(frozen=True)
class Mistakes:
    """How much views of a character that were drawn one by one may differ.

    Attributes:
        wobble: Largest displacement by the unsteady hand, by the picture's side.
        shift: Largest offset of a view, by the picture's side.
        scale: Largest relative difference in size of a view.
        limbs_deg: Largest turn of an arm against the front view; legs turn by up to half of it.
        head_deg: Largest turn of the head against the front view.
    """

    wobble: float
    shift: float
    scale: float
    limbs_deg: float = 0.0
    head_deg: float = 0.0


LEVELS = (
    Mistakes(0.0, 0.0, 0.0),
    Mistakes(0.006, 0.01, 0.015),  # as conf/augmentation/drawing.yaml
    Mistakes(0.006, 0.03, 0.03, limbs_deg=10.0),
    Mistakes(0.006, 0.05, 0.05, limbs_deg=30.0, head_deg=30.0),
)
"""How far drawings disagree: 0 as captured, 1 in place and size, 2 more so and in pose, 3 in another pose in side and back.

One hand draws all levels: how steadily lines are drawn is a matter of the artist, not of how well views agree.
"""


def draw_character(
    character: Character,
    *,
    size: int,
    seed: int,
    level: int = 1,
    azimuths_deg: Mapping[str, float] | None = None,
) -> dict[str, np.ndarray]:
    """Draw a character in one style for all views, each view with mistakes of its own.

    Args:
        character: With its mesh; one without is drawn from its source views, at their size and in its pose.
        size: Side of the drawings, pixels.
        seed: Of the style and of the hand; another character has another style at the same seed.
        level: Of disagreement, index into LEVELS; at 0 views are captured, with their alpha, and neither inked nor moved.
        azimuths_deg: From where it is drawn, by the names that the views get; the first rules. None: front, side, back.

    Returns:
        RGB uint8 (size, size, 3) on paper, RGBA at level 0, by the name of the view.

    Raises:
        ConfigError: If there is no such level.
        DataError: If other views are asked of a character without a mesh.
    """
    if not 0 <= level < len(LEVELS):
        raise ConfigError(f"level: found {level}, expected 0 to {len(LEVELS) - 1}.")
    mistakes = LEVELS[level]
    digest = hashlib.sha256(f"{seed} {character.name}".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[7:15], "little"))
    if character.mesh_file is None:
        if azimuths_deg is not None:
            raise DataError(
                f"{character.folder}: found no mesh to draw {', '.join(azimuths_deg)} of; capture the character again, or take its"
                " captured views."
            )
        names, images = character.source_names, character.sources.images[0]
    else:
        azimuths_deg = azimuths_deg or SOURCE_AZIMUTHS
        names = tuple(azimuths_deg)
        surface = load_surface_mesh(character.mesh_file)
        images = captured(surface, tuple(azimuths_deg.values()), size=size, mistakes=mistakes, rng=rng)
    pixels = on_paper(images, mistakes, seed=int.from_bytes(digest[:7], "little"))
    return dict(zip(names, pixels, strict=True))


def captured(
    surface: SurfaceMesh,
    azimuths_deg: Sequence[float],
    *,
    size: int,
    mistakes: Mistakes,
    rng: np.random.Generator,
) -> Tensor:
    """What somebody has in mind who draws a surface view by view: all but the first in poses of their own, framed as they are.

    Returns:
        RGBA (V, 4, size, size) in [0, 1], straight alpha.
    """
    limbs, head = np.radians(mistakes.limbs_deg), np.radians(mistakes.head_deg)
    if limbs or head:
        joints = find_joints(surface)
        poses = [
            surface,
            *(reposed(surface, joints, random_pose(rng, limbs=limbs, head=head)) for _ in azimuths_deg[1:]),
        ]
        views = [
            capture_sources(pose, size, (azimuth,)) for pose, azimuth in zip(poses, azimuths_deg, strict=True)
        ]
        pictures = np.concatenate(views)
    else:
        pictures = capture_sources(surface, size, azimuths_deg)
    return torch.from_numpy(pictures).permute(0, 3, 1, 2).float() / 255.0


def on_paper(images: Tensor, mistakes: Mistakes, *, seed: int) -> np.ndarray:
    """Views (V, 4, S, S) drawn in one style, each with mistakes of its own; as they are, without paper, where there are none.

    Returns:
        RGB uint8 (V, S, S, 3), or RGBA.
    """
    if not (mistakes.wobble or mistakes.shift or mistakes.scale):
        return to_bytes(images.permute(0, 2, 3, 1))
    generator = torch.Generator().manual_seed(seed)
    style = random_style(generator, wobble=mistakes.wobble, shift=mistakes.shift, scale=mistakes.scale)
    return in_style(images, style, generator)


def in_style(images: Tensor, style: DrawingStyle, generator: torch.Generator) -> np.ndarray:
    """Views (V, 4, S, S) drawn in a style on paper, RGB uint8 (V, S, S, 3)."""
    images = draw_pictures(images, style, generator)
    paper = torch.tensor(PAPER)[:, None, None] / 255.0
    rgb = images[:, :3] * images[:, 3:] + paper * (1.0 - images[:, 3:])
    return to_bytes(rgb.permute(0, 2, 3, 1))


def write_drawings(drawings: dict[str, np.ndarray], folder: Path) -> list[Path]:
    """Write FOLDER/front.png, side.png, back.png."""
    files = [folder / f"{name}.png" for name in drawings]
    for file, pixels in zip(files, drawings.values(), strict=True):
        save_png(file, Image.fromarray(pixels))
    return files
