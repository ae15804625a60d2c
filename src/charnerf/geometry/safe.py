"""The few places where a division or a root needs a guard, with its reason; the stiff parts' precision."""

import torch
from torch import Tensor

from charnerf.checks import check_last_dim


def full_precision(values: Tensor) -> Tensor:
    """Widen bfloat16 and float16 to float32; float32 and float64 pass as they are.

    The stiff parts (encoding, optical depths, transmittance, CDFs) run in this precision also under
    autocast: with 8 bits of mantissa 1 - exp(-1e-4) is 0, and the phase of 2^6 pi x is off by most of a turn.
    """
    return values.float() if values.dtype in (torch.bfloat16, torch.float16) else values


def safe_normalize(vectors: Tensor) -> Tensor:
    """Scale vectors to unit length; zero stays zero, with a zero gradient.

    No epsilon floors the length: the vector is first divided by its largest component, so that neither the
    squares of 1e18 nor those of 1e-30 leave float32. Below the smallest normal number the true gradient, 1 /
    length, is no longer a finite number: there the value is still a unit vector and the gradient is zero.

    Args:
        vectors: (..., 3) or any other last size; half precisions are computed and returned in float32.

    Returns:
        Unit vectors of the same shape; zero where the input is zero (the surface loss passes a zero
        direction, paper section "Mix of 2d ray sampling and 3d surface sampling").
    """
    if vectors.ndim == 0:
        check_last_dim("vectors", vectors, 3)
    vectors = full_precision(vectors)
    largest = vectors.detach().abs().amax(dim=-1, keepdim=True)
    is_zero = largest == 0
    if not torch.is_grad_enabled():  # no gradient to guard: the same numbers in half the passes
        scaled = vectors / largest.masked_fill(is_zero, 1.0)
        return scaled / scaled.square().sum(dim=-1, keepdim=True).sqrt().masked_fill(is_zero, 1.0)
    below_normal = largest < 4.0 * torch.finfo(vectors.dtype).tiny
    scaled = torch.where(below_normal, vectors.detach(), vectors) / torch.where(is_zero, 1.0, largest)
    length = torch.where(is_zero, 1.0, scaled).square().sum(dim=-1, keepdim=True).sqrt()
    return torch.where(is_zero, 0.0, scaled / length)
