"""Cameras of other conventions as ours: +X right, +Y up, looking along -Z."""

import torch
from torch import Tensor


def opengl_of_opencv(poses: Tensor) -> Tensor:
    """world_from_camera (..., 4, 4) of cameras that look along +Z with y down (OpenCV, COLMAP), as ours."""
    return poses * poses.new_tensor((1.0, -1.0, -1.0, 1.0))


def upright(up: str) -> Tensor:
    """Rotation (3, 3), float64, that turns a world's upward axis, `+z`, `+y` or `-y`, to +Z, about x."""
    cosine, sine = {"+z": (1.0, 0.0), "+y": (0.0, 1.0), "-y": (0.0, -1.0)}[up]
    return torch.tensor(((1.0, 0.0, 0.0), (0.0, cosine, -sine), (0.0, sine, cosine)), dtype=torch.float64)
