"""Positional encoding of coordinates and directions."""

import math

import torch
from torch import Tensor

from charnerf.geometry.safe import full_precision


def positional_encoding(x: Tensor, num_frequencies: int) -> Tensor:
    """Encode coordinates as sines and cosines of octaves.

    The phase is reduced exactly before the sine: 2^k x and its remainder modulo the period 2 are exact in
    floating point, so the error stays at rounding for any octave and any |x| up to 1e30, where sin(2^k * pi
    * x) as written loses one bit an octave.

    Args:
        x: (..., C), meant to lie in (-1, 1): the period is 2. Half precisions are computed and returned in
            float32.
        num_frequencies: Octaves, k = 0 .. num_frequencies - 1; 0 gives an empty last axis.

    Returns:
        (..., 2 * C * num_frequencies): for each octave the C sines, then the C cosines, of 2^k pi x; x
        itself is not included.

    Raises:
        ValueError: If num_frequencies is negative.

    Source: paper eq. 1.
    """
    if num_frequencies < 0:
        raise ValueError(f"num_frequencies: found {num_frequencies}, expected 0 or more.")
    x = full_precision(x)
    octaves = 2.0 ** torch.arange(num_frequencies, dtype=x.dtype, device=x.device)
    turns = x[..., None, :] * octaves[:, None]  # (..., K, C)
    phases = math.pi * (turns - 2.0 * torch.round(0.5 * turns.detach()))
    return torch.cat((torch.sin(phases), torch.cos(phases)), dim=-1).flatten(-2)
