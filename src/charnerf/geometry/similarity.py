"""Worlds moved, turned and scaled."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from charnerf.types import Cameras


@dataclass(frozen=True)
class Similarity:
    """x to scale * rotation x + shift, float64: rotation (3, 3), shift (3,)."""

    rotation: Tensor
    scale: float
    shift: Tensor

    def cameras(self, cameras: Cameras) -> Cameras:
        """Cameras (...) that see the moved world as they saw the world."""
        poses = cameras.world_from_camera.double()
        moved = poses.clone()
        moved[..., :3, :3] = self.rotation @ poses[..., :3, :3]
        moved[..., :3, 3] = self.scale * (poses[..., :3, 3] @ self.rotation.T) + self.shift
        focal = cameras.focal.double()
        focal = torch.where(cameras.orthographic[..., None], focal / self.scale, focal)
        return replace(cameras, world_from_camera=moved, focal=focal)
