"""Pictures and cameras of a foreign character as a character of ours: the one place where formats end."""

import logging
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from charnerf.data.characters import CharacterPictures
from charnerf.errors import DataError
from charnerf.foreign.axes import upright
from charnerf.foreign.frame import azimuth_turn, level_direction, standing
from charnerf.foreign.reading import Reading
from charnerf.foreign.shot import Shot, on_canvas
from charnerf.geometry.framing import SOURCE_AZIMUTHS
from charnerf.geometry.similarity import Similarity
from charnerf.types import Cameras

log = logging.getLogger(__name__)

LEAST_SHOTS = 4  # three source views and a target
FARTHEST = 45.0  # degrees from where a source view is looked for; beyond, there is none
WARNED = 20.0  # degrees


def converted(shots: Sequence[Shot], up: str, reading: Reading) -> CharacterPictures:
    """A character's pictures on squares, in our frame, the source views taken out of the targets.

    Raises:
        DataError: If there are too few pictures, one can not be read, or cameras and silhouettes do not fit.
    """
    if len(shots) < LEAST_SHOTS:
        raise DataError(
            f"found {len(shots)} pictures, expected at least {LEAST_SHOTS}: front, side, back and one to measure on."
        )
    _check_numbers(reading, len(shots))
    canvases = [on_canvas(shot, reading.size) for shot in shots]
    images = torch.stack([canvas.rgba for canvas in canvases])
    cameras = Cameras(
        world_from_camera=torch.tensor([shot.pose for shot in shots], dtype=torch.float64).reshape(-1, 4, 4),
        focal=torch.tensor([canvas.focal for canvas in canvases], dtype=torch.float64),
        principal_point=torch.tensor([canvas.centre for canvas in canvases], dtype=torch.float64),
        orthographic=torch.zeros(len(shots), dtype=torch.bool),
        width=reading.size,
        height=reading.size,
    )
    if not reading.keep_frame:
        cameras = _turned(cameras, upright(up), reading.front)
        cameras = standing(cameras, images[..., 3] / 255.0).cameras(cameras)
    sources = source_shots(cameras.world_from_camera[:, :3, 2], reading)
    targets = [index for index in range(len(shots)) if index not in sources.values()]
    chosen = list(sources.values())
    return CharacterPictures(
        cameras=cameras[targets],
        images=np.ascontiguousarray(images[targets].numpy()),
        source_cameras=cameras[chosen],
        source_images=np.ascontiguousarray(images[chosen].numpy()),
        source_names=tuple(sources),
    )


def source_shots(directions: Tensor, reading: Reading) -> dict[str, int]:
    """Which views are front, side and back: those named, else the nearest to level ones at their azimuths.

    Args:
        directions: Unit vectors (N, 3) against the cameras' viewing axes.
        reading: What the user named.

    Returns:
        Numbers by name; a side or back that no camera comes near is left out, and said.

    Raises:
        DataError: If no camera comes near the front.
    """
    named = {name: index for name, index in reading.views.items() if index is not None}
    chosen: dict[str, int] = {}
    for name, azimuth in SOURCE_AZIMUTHS.items():
        if name in named:
            chosen[name] = named[name]
            continue
        away = torch.rad2deg(torch.acos((directions @ level_direction(azimuth)).clamp(-1.0, 1.0)))
        away[list({*chosen.values(), *named.values()})] = torch.inf
        index, angle = int(away.argmin()), float(away.amin())
        if angle <= FARTHEST:
            chosen[name] = index
            if angle > WARNED:
                log.warning(
                    "View %d is taken for the %s, %.0f degrees from it; --%s N names another.",
                    index,
                    name,
                    angle,
                    name,
                )
        elif name == "front":
            raise DataError(
                f"found no camera within {FARTHEST:.0f} degrees of a level front view; name one by --front N."
            )
        else:
            log.warning(
                "No camera is within %.0f degrees of a level %s view; there is none. --%s N names one.",
                FARTHEST,
                name,
                name,
            )
    return chosen


def _turned(cameras: Cameras, rotation: Tensor, front: int | None) -> Cameras:
    """The world turned upright, and so that the front view's camera stands at azimuth 0."""
    nowhere = torch.zeros(3, dtype=torch.float64)
    cameras = Similarity(rotation, 1.0, nowhere).cameras(cameras)
    if front is None:
        return cameras
    return Similarity(azimuth_turn(cameras.world_from_camera[front, :3, 2]), 1.0, nowhere).cameras(cameras)


def _check_numbers(reading: Reading, count: int) -> None:
    for name, index in reading.views.items():
        if index is not None and index >= count:
            raise DataError(f"--{name}: found {index}, but it has {count} views, expected 0 to {count - 1}.")
