"""Which pictures of a character are measured."""

from typing import Literal

import torch

from charnerf.data.characters import Character
from charnerf.errors import DataError
from charnerf.geometry.cameras import fibonacci_hemisphere


def fixed_views(character: Character, views: int | Literal["all"]) -> list[int]:
    """Indices of the frames to evaluate: evenly chosen, the same every time, none of them a source view.

    Each of `views` even directions of the hemisphere takes the nearest frame that is still free: every n-th
    frame of a capture's spiral would leave whole azimuths out.

    Raises:
        DataError: If the character has no such frame.
    """
    poses = character.cameras.world_from_camera
    there = character.sources.present[0]
    sources = character.sources.cameras.world_from_camera[0][there]
    parallel = character.sources.cameras.orthographic[0][there]
    same = (poses[:, None] - sources[None]).abs().amax(dim=(-1, -2)) < 1e-5
    same &= character.cameras.orthographic[:, None] == parallel[None]
    frames = torch.arange(len(poses))[~same.any(dim=1)].tolist()
    if not frames:
        raise DataError(
            f"{character.folder}: found no picture beside the source views, expected some to evaluate; "
            "capture it with more views."
        )
    if views == "all" or views >= len(frames):
        return frames
    if views < 1:
        raise DataError(f"views: found {views}, expected at least 1, or 'all'.")
    towards = poses[frames][:, :3, 2].double()
    free = torch.ones(len(frames), dtype=torch.bool)
    chosen = []
    for ideal in fibonacci_hemisphere(views):
        nearest = int(torch.where(free, towards @ ideal, -torch.inf).argmax())
        free[nearest] = False
        chosen.append(frames[nearest])
    return sorted(chosen)
